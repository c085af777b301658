"""``iveg doctor``: tests every hop of the data path by using it once.

Devices and registrations are repaired as ``iveg provision`` does; then one heartbeat
probe takes the path of a measure.  No robot's topic is written, so it may run while
robots drive.
"""

import asyncio
import secrets
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from iveg.adapters import clock
from iveg.adapters.database_check import check_database
from iveg.adapters.fiware_http import FiwareHttp
from iveg.adapters.history.engine import history_url
from iveg.adapters.mqtt import publish_and_receive
from iveg.adapters.reconciler import describe_failures, own_subscriptions, provision
from iveg.app import open_fiware, site_of
from iveg.cli.arguments import CommandCall
from iveg.cli.nodes import broker_of
from iveg.cli.running import page_address, run_until_stopped
from iveg.domain.errors import HopError, IvegError
from iveg.domain.observations import HeartbeatProbe, Origin
from iveg.domain.probe import SLOW_S, Hop, lag_in_words
from iveg.ngsi import codec, names
from iveg.settings import Settings

PATIENCE_S = 10.0
"""Time limit of each hop (s)."""
_LOOK_EVERY_S = 0.05
_NEEDS: Mapping[Hop, tuple[Hop, ...]] = {
    Hop.AGENT: (Hop.MQTT, Hop.ORION),
    Hop.NOTIFICATIONS: (Hop.ORION, Hop.PAGE),
}
"""Hop → hops that must work before it is tested."""
_ADVICE: Mapping[Hop, str] = {
    Hop.MQTT: "look whether the broker runs, at its access list and password file, and "
    "at IVEG_MQTT_URL, IVEG_MQTT_USER and IVEG_MQTT_PASSWORD",
    Hop.AGENT: "look at the agent's processor time and log, at its connections to the "
    "broker and Orion, and at IVEG_IOTA_URL and IVEG_IOTA_CB_URL",
    Hop.ORION: "look whether Orion and its MongoDB run, and at IVEG_ORION_URL; behind "
    "a proxy, at IVEG_FIWARE_TOKEN_URL and the roles there",
    Hop.NOTIFICATIONS: "look whether Orion's machine reaches iVeg (firewall, container "
    "network), and at IVEG_NOTIFY_URL",
    Hop.DATABASE: "look whether the server runs, and at IVEG_DATABASE_URL; STOP and "
    "the live map go on without",
    Hop.PAGE: "look whether `iveg serve` runs, and at IVEG_HOST and IVEG_PORT",
}


@dataclass(frozen=True, slots=True)
class Finding:
    """Result of a tested hop; ``said`` is the reason of a failure, or a remark."""

    is_ok: bool
    said: str = ""


Findings = dict[Hop, Finding]
_Step = Callable[[], Awaitable[object]]


def run(call: CommandCall) -> int:
    """Test all hops and print a line for each; returns the exit code."""
    findings: Findings = {}
    run_until_stopped(examine(call.settings, call.data, findings))
    for hop in Hop:
        print(write_line(hop, findings))
    return int(not all(hop in findings and findings[hop].is_ok for hop in Hop))


def write_line(hop: Hop, findings: Findings) -> str:
    """Line of a hop: name, verdict and advice in one sentence."""
    finding = findings.get(hop)
    if finding is None:
        verdict, sentence = "not tried", "repair the failed hops first"
    elif finding.is_ok:
        verdict, sentence = "ok", finding.said
    else:
        verdict, sentence = "failed", f"{finding.said}; {_ADVICE[hop]}"
    return f"{hop:<13}  {verdict:<9}  {sentence}".rstrip()


async def examine(
    settings: Settings, data: Path, findings: Findings, patience_s: float = PATIENCE_S
) -> None:
    """Test every hop, one after the other.

    Args:
        settings: Addresses of the parts.
        data: Directory of the history unless the settings name another.
        findings: Filled hop by hop; hops that need a failed hop are left out.
        patience_s: Time limit of each hop (s).
    """
    database = history_url(settings.database_url, data)
    path = _Path(settings)
    async with path.orion, path.agent, path.page:
        steps: tuple[tuple[Hop, _Step], ...] = (
            (Hop.MQTT, path.publish_probe),
            (Hop.ORION, path.orion.version),
            (Hop.AGENT, path.send_measure),
            (Hop.PAGE, partial(path.page.ask, "GET", "/healthz")),
            (Hop.NOTIFICATIONS, path.look_at_subscriptions),
            (Hop.DATABASE, partial(asyncio.to_thread, check_database, database)),
        )
        for hop, step in steps:
            needs = (findings.get(need) for need in _NEEDS.get(hop, ()))
            if all(need is not None and need.is_ok for need in needs):
                findings[hop] = await _try(step, patience_s)


async def _try(step: _Step, patience_s: float) -> Finding:
    try:
        async with asyncio.timeout(patience_s):
            result = await step()
            return result if isinstance(result, Finding) else Finding(True)
    except TimeoutError:
        return Finding(False, f"nothing came in {patience_s:g} s")
    except HopError as error:
        return Finding(False, error.detail)
    except (IvegError, OSError) as error:
        return Finding(False, str(error))


class _Page(FiwareHttp):
    HOP = Hop.PAGE


class _Path:
    """Tests of hops of the data path; each raises HopError where it fails."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.orion, self.agent = open_fiware(settings)
        self.page = _Page(page_address(settings), "", "")

    async def publish_probe(self) -> str:
        """Publish a probe and receive it from the broker; returns its stamp."""
        stamp = codec.format_stamp(clock.wall())
        payload = codec.write_heartbeat(Origin(secrets.token_hex(4), 1, stamp))
        topic = names.measure_topic(self._settings.apikey, names.HEARTBEAT_ID)
        await publish_and_receive(broker_of(self._settings), topic, payload)
        return stamp

    async def send_measure(self) -> Finding:
        """Repair the devices, then send a probe and wait until Orion has it."""
        await self.agent.version()
        await provision(self.agent, self.orion, site_of(self._settings))
        began, stamp = clock.mono(), await self.publish_probe()
        # Orion is polled: notifications are tested by another hop.
        while not await self._has_probe(stamp):  # noqa: ASYNC110
            await asyncio.sleep(_LOOK_EVERY_S)
        took_s = clock.mono() - began
        return Finding(True, lag_in_words(took_s) if took_s > SLOW_S else "")

    async def _has_probe(self, stamp: str) -> bool:
        """Whether Orion has this probe, or a later one of a running iVeg."""
        read = codec.read_entity(await self.orion.read_probe() or {})
        return any(
            isinstance(probe, HeartbeatProbe) and (probe.origin.stamp or "") >= stamp
            for probe in read.observations
        )

    async def look_at_subscriptions(self) -> None:
        """Check at Orion that iVeg's subscriptions exist and deliver."""
        ours = await own_subscriptions(self.orion)
        if failing := describe_failures(ours):
            raise HopError(Hop.NOTIFICATIONS, failing)
        if not ours:
            raise HopError(Hop.NOTIFICATIONS, "Orion has no subscription of iVeg")
