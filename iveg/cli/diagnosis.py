"""Evaluation of the findings of ``iveg doctor``: rows, sentences, exit code; no I/O.

A hop is tested only when the hops it depends on are well, so that one broken part is
one failed row and not six.  The order is the order of the examination.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from iveg.domain.hops import NEEDS, Check, Hop
from iveg.domain.probe import lag_in_words

State = Literal["ok", "failed", "not tried"]


_ORION_WAITS_S = 4.0
"""Nearly the five seconds for which Orion waits for an agent."""
LATE_S = 1.0
"""Age of a late measure (s), as in a running iVeg."""


@dataclass(frozen=True, slots=True)
class Lag:
    """Delay of measures on their way to Orion.

    Attributes:
        lag_s: Seconds.
        growing: Whether it is known to grow.
        at_least: Whether the true lag may be longer.
        told_by: Source of the lag, as a clause; empty for the doctor's own measure.
    """

    lag_s: float
    growing: bool = False
    at_least: bool = False
    told_by: str = ""

    @property
    def sentence(self) -> str:
        """A sentence such as "Measures reach Orion 23 s late, growing"."""
        said = lag_in_words(self.lag_s, growing=self.growing, at_least=self.at_least)
        return said[0].upper() + said[1:] + self.told_by


@dataclass(frozen=True, slots=True)
class Stack:
    """Addresses for the sentences.

    Attributes:
        broker: Host and port of the MQTT broker.
        user: User name at the broker; empty for anonymous.
        listener: Address that Orion was asked to post to.
        topics: The probe device's topics, up to the last slash.
        lag: Delay of measures, where that is known to be the cause.
        waited_s: Time that the doctor waited for its measure (s).
    """

    broker: str
    user: str
    orion: str
    agent: str
    listener: str
    database: str
    page: str
    topics: str
    lag: Lag | None = None
    waited_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of one tested hop.

    Attributes:
        took_s: Duration, or time waited (s).
        trouble: None for success; the reason of a refusal; empty for a time-out.
    """

    check: Check
    took_s: float
    trouble: str | None = None

    @property
    def well(self) -> bool:
        """Whether the hop works."""
        return self.trouble is None


@dataclass(frozen=True, slots=True)
class DiagnosisRow:
    """One line of the table; ``sentence`` is empty for a hop that works."""

    check: Check
    state: State
    took_s: float | None = None
    sentence: str = ""


Findings = Mapping[Check, Finding]


def missing(check: Check, findings: Findings) -> tuple[Check, ...]:
    """The hops that a hop depends on and that do not work."""
    return tuple(
        need for need in NEEDS[check] if need not in findings or not findings[need].well
    )


def judge(findings: Findings, stack: Stack) -> list[DiagnosisRow]:
    """Every hop with its state and, where it failed, advice."""
    return [_row(check, findings, stack) for check in Check]


def exit_code(rows: Sequence[DiagnosisRow]) -> int:
    """0 if every hop works, else 1."""
    return int(any(row.state != "ok" for row in rows))


def table(rows: Sequence[DiagnosisRow]) -> str:
    """The rows as text: hop, state, milliseconds, and sentences below their row."""
    wide = max(len(check) for check in Check)
    lines = [f"{'hop':<{wide}}  {'state':<9}  {'ms':>6}"]
    for row in rows:
        took = "" if row.took_s is None else f"{row.took_s * 1000:.0f}"
        lines.append(f"{row.check:<{wide}}  {row.state:<9}  {took:>6}".rstrip())
        if row.sentence:
            lines.append(f"    {row.sentence}")
    return "\n".join(lines)


def _row(check: Check, findings: Findings, stack: Stack) -> DiagnosisRow:
    finding = findings.get(check)
    if finding is None and stack.lag is not None and check.hop is Hop.AGENT:
        return DiagnosisRow(
            check, "not tried", None, "The agent is behind: nothing is added."
        )
    if finding is None:
        because = " and ".join(f"“{need}”" for need in missing(check, findings))
        return DiagnosisRow(
            check, "not tried", None, f"Stands on {because}." if because else ""
        )
    if finding.trouble is None:
        late = check == Check.MEASURE and finding.took_s > LATE_S
        sentence = f"{Lag(finding.took_s).sentence}." if late else ""
        return DiagnosisRow(check, "ok", finding.took_s, sentence)
    said = finding.trouble or f"nothing came in {finding.took_s:.1f} s"
    away = check == Check.AGENT and not _is_silence(said)
    if stack.lag is not None and check.hop is Hop.AGENT and not away:
        sentence = _overloaded(check, said, stack, stack.lag)
        return DiagnosisRow(check, "failed", finding.took_s, sentence)
    return DiagnosisRow(
        check, "failed", finding.took_s, _SENTENCES[check](said, stack, findings)
    )


def _overloaded(check: Check, said: str, stack: Stack, lag: Lag) -> str:
    """Overload, reported before addresses, tenants or databases."""
    if check not in (Check.AGENT, Check.MEASURE):
        return f"The agent is behind ({said}); {lag_in_words(lag.lag_s)}."
    return (
        f"{lag.sentence} ({said}): the agent at {stack.agent} is overloaded. Let the "
        "robots send less, or let several agents share the load; STOP still goes "
        "straight over MQTT."
    )


def _broker(said: str, stack: Stack, _: Findings) -> str:
    if "not auth" in said.lower() or "password" in said.lower():
        who = f"user {stack.user}" if stack.user else "nobody in particular"
        return (
            f"The broker at {stack.broker} refuses {who} ({said}): look at "
            "IVEG_MQTT_USER and IVEG_MQTT_PASSWORD and at the broker's password file."
        )
    if "echo" in said:
        return (
            f"The broker at {stack.broker} lets us in and {said}: look at its access "
            f"list; user {stack.user or '(nobody)'} must write and read "
            f"{stack.topics}#."
        )
    return (
        f"No MQTT at {stack.broker} ({said}): look whether the broker runs, and at "
        "IVEG_MQTT_URL."
    )


def _orion(said: str, stack: Stack, _: Findings) -> str:
    return (
        f"No Orion at {stack.orion} ({said}): look whether Orion and its MongoDB run, "
        "and at IVEG_ORION_URL."
    )


def _agent(said: str, stack: Stack, _: Findings) -> str:
    if _is_silence(said):
        return (
            f"The IoT Agent at {stack.agent} takes questions and does not answer "
            f"({said}): it is overloaded or hung; look at its processor time first, "
            "then at its log."
        )
    return (
        f"No IoT Agent at {stack.agent} ({said}): look whether it runs, at its log, "
        "and at IVEG_IOTA_URL."
    )


def _device(said: str, stack: Stack, _: Findings) -> str:
    if _is_silence(said):
        return (
            f"The agent at {stack.agent} did not answer to a new device ({said}): it "
            "is overloaded or hung; look at its processor time first, then at its log."
        )
    return (
        f"The agent at {stack.agent} does not take a device with a command ({said}): "
        "it registers the command at Orion, so look at the agent's own address of "
        "Orion, at its MongoDB and at IVEG_FIWARE_SERVICE and IVEG_FIWARE_SERVICEPATH."
    )


def _measure(said: str, stack: Stack, findings: Findings) -> str:
    least = Lag(stack.waited_s, at_least=True).sentence
    first = (
        f"{least}, or never ({said}). First look whether the agent is overloaded: the "
        "processor time it takes, and whether this changes within a minute. If not, "
    )
    command = findings.get(Check.COMMAND)
    if command is not None and command.well:
        return first + (
            f"it sends commands and receives nothing on {stack.topics}attrs: its "
            "connection is broken, or the broker's access list keeps the topic from "
            "it; restart the agent and look at its log."
        )
    return first + (
        "look whether the agent is connected to the same broker, may read "
        f"{stack.topics}attrs, and reaches Orion at the address that iVeg gave it "
        "(IVEG_IOTA_CB_URL)."
    )


def _notification(said: str, stack: Stack, _: Findings) -> str:
    return (
        f"Orion did not post to {stack.listener} ({said}): look whether Orion's "
        "machine reaches this one there (firewall, container network), and at the "
        "host in IVEG_NOTIFY_URL."
    )


def _command(said: str, stack: Stack, findings: Findings) -> str:
    if said.startswith("404") and _took_long(findings):
        return (
            f"Orion cannot pass a command on ({said}): the agent did not answer Orion "
            "in five seconds, so it is overloaded or hung; look at its processor time."
        )
    if said.startswith("404"):
        return (
            f"Orion cannot pass a command on ({said}): with this answer it says that "
            "it does not reach the agent; look at IOTA_PROVIDER_URL of the agent, the "
            "address under which Orion calls it."
        )
    return (
        f"Orion took a command and the device never got it ({said}): look whether the "
        f"agent is connected to the broker and may write {stack.topics}cmd. STOP still "
        "goes straight over MQTT."
    )


def _took_long(findings: Findings) -> bool:
    """Orion answers 404 at once for an absent agent, after 5 s for a silent one."""
    finding = findings.get(Check.COMMAND)
    return finding is not None and finding.took_s > _ORION_WAITS_S


def _is_silence(said: str) -> bool:
    return said.startswith(("no answer", "nothing came"))


def _answer(said: str, stack: Stack, _: Findings) -> str:
    return (
        f"The device's answer on {stack.topics}cmdexe is not in Orion ({said}), though "
        "its measure was: look whether the broker lets the agent read the topic."
    )


def _direct(said: str, stack: Stack, _: Findings) -> str:
    return (
        f"A command straight on {stack.topics}cmd did not arrive ({said}): look at the "
        f"broker's access list; user {stack.user or '(nobody)'} must write /+/+/cmd."
    )


def _database(said: str, stack: Stack, _: Findings) -> str:
    if "iveg db upgrade" in said:
        return f"The history in {stack.database} cannot be used yet: {said}."
    return (
        f"The history in {stack.database} cannot be read ({said}): look whether the "
        "server runs, and at IVEG_DATABASE_URL. STOP and the live map go on without."
    )


def _page(said: str, stack: Stack, _: Findings) -> str:
    return (
        f"iVeg itself does not answer at {stack.page} ({said}): look whether `iveg "
        "serve` runs, and at IVEG_HOST and IVEG_PORT."
    )


_SENTENCES: Mapping[Check, Callable[[str, Stack, Findings], str]] = {
    Check.BROKER: _broker,
    Check.ORION: _orion,
    Check.AGENT: _agent,
    Check.DEVICE: _device,
    Check.MEASURE: _measure,
    Check.NOTIFICATION: _notification,
    Check.COMMAND: _command,
    Check.ANSWER: _answer,
    Check.DIRECT: _direct,
    Check.DATABASE: _database,
    Check.PAGE: _page,
}
