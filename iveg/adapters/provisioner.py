"""Provisioner: keeps the FIWARE data path working by itself.

Devices and subscriptions are made at the start and checked for ever.  After a gap a
read of all robots brings the world up to date.  A probe measure goes out every two
seconds, because only its return proves that the path works.

The probe, a short question to Orion, one to the agent, and the repairs are tasks of
their own, so that none of them waits for a slow neighbour.
"""

import asyncio
import contextlib
import logging
import random
from collections.abc import Awaitable, Callable, Sequence

from iveg.adapters import clock
from iveg.adapters.fiware_http import MEANINGLESS
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.mqtt import MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.reconciler import (
    FiwareSite,
    OwnSubscriptions,
    ensure_subscriptions,
    provision,
    wanted_for,
)
from iveg.domain.errors import HopError, NoAnswerError
from iveg.domain.observations import HeartbeatProbe, Instant, Origin, Received
from iveg.domain.probe import SLOW_S
from iveg.domain.transports import FIWARE
from iveg.ngsi import codec, names
from iveg.vital.health_monitor import PROBE_PERIOD_S, HealthMonitor
from iveg.vital.ingest import Ingest

_log = logging.getLogger(__name__)
_ASK_PERIOD_S, _REPAIR_PERIOD_S = 1.0, 4.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.5, 3.0
_UNANSWERED_S = 30.0
"""Pause of device checks after a check without an answer (s): the agent may still be
busy."""
_DEVICES_PERIOD_S = 12.0
"""Time between two device checks while all is well (s)."""


class Provisioner:
    """Provisioning, subscriptions, reconciling reads and the heartbeat probe.

    Attributes:
        subscriptions: Subscriptions of ours at Orion.
    """

    def __init__(
        self,
        orion: OrionClient,
        agent: IotAgentClient,
        link: MqttLink,
        health_monitor: HealthMonitor,
        ingest: Ingest,
        site: FiwareSite,
    ) -> None:
        self._orion, self._agent, self._link = orion, agent, link
        self._health_monitor, self._ingest, self._site = health_monitor, ingest, site
        self._probe_seq = 0
        self._devices_at = self._unanswered_until = 0.0
        self._broken: set[str] = set()
        self._gap = asyncio.Event()
        self.subscriptions = OwnSubscriptions()

    async def run(self) -> None:
        """Run probe, questions and repairs until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._send_probes())
            tasks.create_task(_repeat(self._ask_orion, _ASK_PERIOD_S))
            tasks.create_task(_repeat(self._ask_agent, _ASK_PERIOD_S))
            tasks.create_task(_repeat(self._repair, _REPAIR_PERIOD_S, self._gap))

    # --- the heartbeat probe --------------------------------------------------------

    async def _send_probes(self) -> None:
        """Publish probes at QoS 1: only a confirmation proves that the broker works."""
        topic = names.measure_topic(self._site.apikey, names.HEARTBEAT_ID)
        while True:
            if not self._link.connected:
                # The health monitor reports a lost connection by itself.
                self._health_monitor.mqtt_error = ""
                await asyncio.sleep(0.1)
                continue
            self._probe_seq += 1
            now = clock.now()
            stamp = codec.format_stamp(now.wall)
            origin = Origin(self._site.boot, self._probe_seq, stamp)
            self._health_monitor.probe.sent(origin, now)
            try:
                await self._link.publish(topic, codec.write_heartbeat(origin))
                self._health_monitor.mqtt_error = ""
            except HopError:
                silent = "takes messages and does not confirm them"
                self._health_monitor.mqtt_error = silent
            duration_s = clock.now().mono - now.mono
            await asyncio.sleep(max(0.1, PROBE_PERIOD_S - duration_s))

    # --- short questions ----------------------------------------------------------

    async def _ask_orion(self) -> bool:
        """Check that Orion answers, and read the newest probe that it has stored."""
        monitor, before = self._health_monitor, clock.now()
        try:
            entity = await self._orion.read_probe()
        except HopError as error:
            monitor.orion_error = error.detail
            return self._log_change("orion", error)
        at = clock.now()
        monitor.orion_ok_at = at.mono
        monitor.orion_slow = _slow(at.mono - before.mono)
        for observation in codec.read_entity(entity or {}).observations:
            if isinstance(observation, HeartbeatProbe):
                monitor.stored(observation.origin)
        if monitor.orion_error:
            monitor.orion_error = ""
            self._gap.set()
        return self._log_change("orion", None)

    async def _ask_agent(self) -> bool:
        monitor, before = self._health_monitor, clock.now()
        try:
            await self._agent.version()
        except HopError as error:
            is_silent = isinstance(error, NoAnswerError)
            monitor.agent_silent = error.detail if is_silent else ""
            monitor.agent_error = "" if is_silent else error.detail
            return self._log_change("iot_agent", error)
        monitor.agent_slow = _slow(clock.now().mono - before.mono)
        if self._agent_trouble:
            monitor.agent_error = monitor.agent_silent = ""
            self._unanswered_until = 0.0
            self._gap.set()
        return self._log_change("iot_agent", None)

    @property
    def _agent_trouble(self) -> str:
        return self._health_monitor.agent_error or self._health_monitor.agent_silent

    # --- devices, subscriptions, reads --------------------------------------------

    async def _repair(self) -> bool:
        """Check devices, then subscriptions, then read all robots to fill the gap.

        Orion sends nothing when a subscription is made, so the read comes last.
        """
        # First, so that a gap during this repair starts the next one.
        self._gap.clear()
        devices = self._devices_are_due(clock.now())
        if self._health_monitor.orion_error:
            return False
        is_whole = True
        if devices and not self._agent_trouble:
            is_whole = await self._try("devices", "iot_agent", self._check_devices)
        for subject, work in (
            ("subscriptions", self._check_subscriptions),
            ("reading", self._read_robots),
        ):
            is_whole = await self._try(subject, "orion", work) and is_whole
        return is_whole and not self._agent_trouble

    def _devices_are_due(self, now: Instant) -> bool:
        """Whether to check devices; never while the agent is behind: it adds load."""
        monitor = self._health_monitor
        if monitor.is_overloaded(now) or now.mono < self._unanswered_until:
            return False
        return now.mono >= self._devices_at or not monitor.whole(now)

    async def _try(
        self, what: str, hop: str, work: Callable[[], Awaitable[None]]
    ) -> bool:
        """Do one part of the repairs; returns the success."""
        try:
            await work()
        except HopError as error:
            failure = error
        except (AttributeError, KeyError, TypeError, ValueError):
            # A neighbour's JSON may have any shape, and only its use shows a wrong one.
            failure = HopError(hop, MEANINGLESS)
        else:
            return self._log_change(what, None)
        if what == "devices":
            self._health_monitor.agent_warning = failure.detail
            if isinstance(failure, NoAnswerError):
                self._unanswered_until = clock.now().mono + _UNANSWERED_S
        elif what == "subscriptions":
            self._health_monitor.notify_error = failure.detail
        ask = self._ask_agent if failure.hop == "iot_agent" else self._ask_orion
        # A neighbour that is down has been logged by its own question.
        return await ask() and self._log_change(what, failure)

    async def _check_devices(self) -> None:
        self._devices_at = clock.now().mono + _DEVICES_PERIOD_S
        result = await provision(self._agent, self._orion, self._site)
        for sentence in result.mended:
            _log.info("%s", sentence)
        # Problems that only a person can solve stay on the health page.
        self._health_monitor.agent_warning = _summary(result.problems)

    async def _check_subscriptions(self) -> None:
        site, monitor, own = self._site, self._health_monitor, self.subscriptions
        own.is_changing = True
        try:
            result = await ensure_subscriptions(
                self._orion,
                site.notify_url,
                site.notify_token,
                wanted_for(site.tiles, site.scanned),
            )
        finally:
            own.is_changing = False
        # Subscriptions made at the start were not missing before.
        repairs = _summary(result.mended) if own.ids else ""
        own.ids = result.ids
        own.former_secrets |= result.former_secrets
        for sentence in result.mended:
            _log.info("%s", sentence)
        monitor.notify_detail, monitor.notify_error = result.failing, repairs
        if repairs:
            raise HopError("notifications", repairs)

    async def _read_robots(self) -> None:
        """Read all robots, to restore data that a gap has lost."""
        entities = await self._orion.read_robots()
        at = clock.now()
        for entity in entities:
            for observation in codec.read_entity(entity).observations:
                # The tenant may also hold robots that are not of this fleet.
                if observation.robot_id in self._site.robots:
                    self._ingest.enqueue(
                        Received(observation, at, FIWARE.id, is_query_answer=True)
                    )

    def _log_change(self, what: str, error: HopError | None) -> bool:
        """Log a loss once and a repair once; returns whether there is no error."""
        if error is not None and what not in self._broken:
            self._broken.add(what)
            _log.warning("%s differs from the wanted state: %s", what, error)
        elif error is None and what in self._broken:
            self._broken.discard(what)
            _log.info("%s repaired", what)
        return error is None


async def _repeat(
    work: Callable[[], Awaitable[bool]],
    period_s: float,
    gap: asyncio.Event | None = None,
) -> None:
    """Repeat work for ever: at once after a gap, ever later while it fails."""
    pause = _FIRST_PAUSE_S
    while True:
        if await work():
            pause, rest_s = _FIRST_PAUSE_S, period_s
        else:
            rest_s = pause * random.uniform(0.5, 1.0)  # noqa: S311 - jitter, no secret
            pause = min(_LONGEST_PAUSE_S, 2 * pause)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(rest_s):
                await (gap or asyncio.Event()).wait()


def _summary(sentences: Sequence[str]) -> str:
    """The first sentence, and the number of further sentences; empty for none."""
    suffix = f" And {len(sentences) - 1} more." if len(sentences) > 1 else ""
    return sentences[0] + suffix if sentences else ""


def _slow(spent_s: float) -> str:
    """Warning about a long response time (s); empty for a short one."""
    return f"answers take {spent_s:.1f} s" if spent_s > SLOW_S else ""
