"""Advice about a failed hop: its known causes, and where to look otherwise."""

from collections.abc import Mapping, Sequence

from iveg.adapters.fiware_http import NO_TOKEN
from iveg.cli.findings import Case, Finding, Findings, Lag, Stack
from iveg.domain.hops import Check, Hop
from iveg.domain.probe import lag_in_words

_ORION_WAITS_S = 4.0
"""Nearly the five seconds for which Orion waits for an agent."""


def advise(failed: Finding, findings: Findings, stack: Stack) -> str:
    """Sentence about a failure; overload comes before addresses and databases."""
    check, lag = failed.check, stack.lag
    said = failed.trouble or f"nothing came in {failed.took_s:.1f} s"
    is_away = check == Check.AGENT and not _is_silence(said, findings)
    if lag is not None and check.hop is Hop.AGENT and not is_away:
        is_first = check in (Check.AGENT, Check.MEASURE)
        form = _OVERLOADED if is_first else _BEHIND
    else:
        known = (
            form
            for one, applies, form in _KNOWN_CAUSES
            if one == check and applies(said, findings)
        )
        form = next(known, _FAILED[check])
    return form.format(
        said=said,
        at=stack,
        user=stack.user or "(nobody)",
        who=f"user {stack.user}" if stack.user else "nobody in particular",
        lag=lag and lag.sentence,
        late=lag and lag_in_words(lag.lag_s),
        least=Lag(stack.waited_s, at_least=True).sentence,
    )


def _says(*words: str) -> Case:
    """A failure whose reason names one of these words."""
    return lambda said, _: any(word in said.lower() for word in words)


def _is_silence(said: str, _: Findings) -> bool:
    return said.startswith(("no answer", "nothing came"))


def _sends(_: str, findings: Findings) -> bool:
    """Whether the agent sends commands, though it receives nothing."""
    command = findings.get(Check.COMMAND)
    return command is not None and command.well


def _is_refused(said: str, _: Findings) -> bool:
    return said.startswith("404")


def _is_refused_late(said: str, findings: Findings) -> bool:
    """Orion answers 404 at once for an absent agent, after 5 s for a silent one."""
    return (
        _is_refused(said, findings) and findings[Check.COMMAND].took_s > _ORION_WAITS_S
    )


_OVERLOADED = (
    "{lag} ({said}): the agent at {at.agent} is overloaded. Let the robots send less, "
    "or let several agents share the load; STOP still goes straight over MQTT."
)


_BEHIND = "The agent is behind ({said}); {late}."


_NEVER_CAME = (
    "{least}, or never ({said}). First look whether the agent is overloaded: the "
    "processor time it takes, and whether this changes within a minute. If not, "
)


def _at_the_proxy(
    check: Check, name: str, at: str
) -> Sequence[tuple[Check, Case, str]]:
    """What fails before a neighbour: the token endpoint, or a proxy that refuses."""
    no_token = (
        f"There is no bearer for {name} ({{said}}), and without one it is not asked: "
        "look at the token endpoint {at.token} (IVEG_FIWARE_TOKEN_URL), and at client, "
        "secret and user there."
    )
    refused = (
        f"A proxy before {name} at {at} refuses iVeg ({{said}}): look at the roles "
        "that it asks for, at IVEG_FIWARE_TOKEN_HEADER, and whether "
        "IVEG_FIWARE_TOKEN_URL is set."
    )
    return (
        (check, _says(NO_TOKEN), no_token),
        (check, lambda said, _: said.startswith(("401 ", "403 ")), refused),
    )


_KNOWN_CAUSES: Sequence[tuple[Check, Case, str]] = (
    *_at_the_proxy(Check.ORION, "Orion", "{at.orion}"),
    *_at_the_proxy(Check.AGENT, "the IoT Agent", "{at.agent}"),
    (
        Check.BROKER,
        _says("not auth", "password"),
        "The broker at {at.broker} refuses {who} ({said}): look at IVEG_MQTT_USER and "
        "IVEG_MQTT_PASSWORD and at the broker's password file.",
    ),
    (
        Check.BROKER,
        _says("echo"),
        "The broker at {at.broker} lets us in and {said}: look at its access list; "
        "user {user} must write and read {at.topics}#.",
    ),
    (
        Check.AGENT,
        _is_silence,
        "The IoT Agent at {at.agent} takes questions and does not answer ({said}): it "
        "is overloaded or hung; look at its processor time first, then at its log.",
    ),
    (
        Check.DEVICE,
        _is_silence,
        "The agent at {at.agent} did not answer to a new device ({said}): it is "
        "overloaded or hung; look at its processor time first, then at its log.",
    ),
    (
        Check.MEASURE,
        _sends,
        _NEVER_CAME + "it sends commands and receives nothing on {at.topics}attrs: its "
        "connection is broken, or the broker's access list keeps the topic from it; "
        "restart the agent and look at its log.",
    ),
    (
        Check.COMMAND,
        _is_refused_late,
        "Orion cannot pass a command on ({said}): the agent did not answer Orion in "
        "five seconds, so it is overloaded or hung; look at its processor time.",
    ),
    (
        Check.COMMAND,
        _is_refused,
        "Orion cannot pass a command on ({said}): with this answer it says that it "
        "does not reach the agent; look at IOTA_PROVIDER_URL of the agent, the "
        "address under which Orion calls it.",
    ),
    (
        Check.DATABASE,
        _says("iveg db upgrade"),
        "The history in {at.database} cannot be used yet: {said}.",
    ),
)
"""Failures whose cause the reason tells."""


_FAILED: Mapping[Check, str] = {
    Check.BROKER: "No MQTT at {at.broker} ({said}): look whether the broker runs, and "
    "at IVEG_MQTT_URL.",
    Check.ORION: "No Orion at {at.orion} ({said}): look whether Orion and its MongoDB "
    "run, and at IVEG_ORION_URL.",
    Check.AGENT: "No IoT Agent at {at.agent} ({said}): look whether it runs, at its "
    "log, and at IVEG_IOTA_URL.",
    Check.DEVICE: "The agent at {at.agent} does not take a device with a command "
    "({said}): it registers the command at Orion, so look at the agent's own address "
    "of Orion, at its MongoDB and at IVEG_FIWARE_SERVICE and IVEG_FIWARE_SERVICEPATH.",
    Check.MEASURE: _NEVER_CAME + "look whether the agent is connected to the same "
    "broker, may read {at.topics}attrs, and reaches Orion at the address that iVeg "
    "gave it (IVEG_IOTA_CB_URL).",
    Check.NOTIFICATION: "Orion did not post to {at.listener} ({said}): look whether "
    "Orion's machine reaches this one there (firewall, container network), and at the "
    "host in IVEG_NOTIFY_URL.",
    Check.COMMAND: "Orion took a command and the device never got it ({said}): look "
    "whether the agent is connected to the broker and may write {at.topics}cmd. STOP "
    "still goes straight over MQTT.",
    Check.ANSWER: "The device's answer on {at.topics}cmdexe is not in Orion ({said}), "
    "though its measure was: look whether the broker lets the agent read the topic.",
    Check.DIRECT: "A command straight on {at.topics}cmd did not arrive ({said}): look "
    "at the broker's access list; user {user} must write /+/+/cmd.",
    Check.DATABASE: "The history in {at.database} cannot be read ({said}): look "
    "whether the server runs, and at IVEG_DATABASE_URL. STOP and the live map go on "
    "without.",
    Check.PAGE: "iVeg itself does not answer at {at.page} ({said}): look whether `iveg "
    "serve` runs, and at IVEG_HOST and IVEG_PORT.",
}
