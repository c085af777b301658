"""Provisioner: keeps the FIWARE data path working by itself.

Devices and subscriptions are made at the start and checked for ever; after a gap one
read of all robots brings the world up to date; a probe measure goes out every two
seconds, because only its return proves that the path works.

Three tasks run beside each other, so that none of them waits for a slow neighbour: the
probe, a short question to Orion and to the agent, and the repairs.
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
"""No look at devices for so long after one that got no answer: it may be queued."""
_DEVICES_PERIOD_S = 12.0
"""Between two looks at devices while all is well."""


class Provisioner:
    """Provisioning, subscriptions, reconciling reads and the heartbeat probe.

    Attributes:
        subscription_ids: Ids of our subscriptions.
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
        self.subscription_ids: frozenset[str] = frozenset()
        self._former_secrets: frozenset[str] = frozenset()
        self._is_subscribing = False

    def is_ours(self, subscription_id: str) -> bool:
        """Whether a notification is one that was asked for.

        Orion may notify of a subscription before it has said its id, and after a
        restart of ours of those that were made before: while some are made, and until
        the first are known, each that brings our secret is ours.
        """
        return (
            subscription_id in self.subscription_ids
            or self._is_subscribing
            or not self.subscription_ids
        )

    def is_former(self, secret: str) -> bool:
        """Whether a secret may be that of an earlier start, which Orion still brings.

        Until Orion has said which subscriptions have our name, any may be.
        """
        return secret in self._former_secrets or not self.subscription_ids

    async def run(self) -> None:
        """Until cancelled."""
        watch, repair = _ASK_PERIOD_S, _REPAIR_PERIOD_S
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._send_probes(), name="probe")
            tasks.create_task(_repeat(self._ask_orion, watch), name="watch-orion")
            tasks.create_task(_repeat(self._ask_agent, watch), name="watch-agent")
            work = _repeat(self._repair, repair, self._gap)
            tasks.create_task(work, name="look-after")

    # --- the heartbeat probe --------------------------------------------------------

    async def _send_probes(self) -> None:
        """At QoS 1: a broker that is there and does nothing says nothing either."""
        topic = names.measure_topic(self._site.apikey, names.HEARTBEAT_ID)
        while True:
            if not self._link.connected:
                self._health_monitor.mqtt_error = ""
                await asyncio.sleep(0.1)
                continue
            self._probe_seq += 1
            now = clock.now()
            stamp = codec.format_stamp(now.wall)
            origin = Origin(self._site.boot, self._probe_seq, stamp)
            self._health_monitor.sent(origin, now)
            complaint = ""
            try:
                await self._link.publish(topic, codec.write_heartbeat(origin))
            except HopError:
                complaint = "takes messages and does not confirm them"
            self._health_monitor.mqtt_error = complaint
            spent = clock.now().mono - now.mono
            await asyncio.sleep(max(0.1, PROBE_PERIOD_S - spent))

    # --- short questions ----------------------------------------------------------

    async def _ask_orion(self) -> bool:
        """Prove that Orion answers, and how far the probe came."""
        monitor, before = self._health_monitor, clock.now()
        try:
            entity = await self._orion.read_probe()
        except HopError as error:
            monitor.orion_error = error.detail
            return self._tell("orion", error)
        at = clock.now()
        monitor.orion_ok_at = at.mono
        monitor.orion_slow = _slow(at.mono - before.mono)
        for observation in codec.read_entity(entity or {}).observations:
            if isinstance(observation, HeartbeatProbe):
                monitor.stored(observation.origin)
        if monitor.orion_error:
            monitor.orion_error = ""
            self._gap.set()
        return self._tell("orion", None)

    async def _ask_agent(self) -> bool:
        monitor, before = self._health_monitor, clock.now()
        try:
            await self._agent.version()
        except HopError as error:
            is_silent = isinstance(error, NoAnswerError)
            monitor.agent_silent = error.detail if is_silent else ""
            monitor.agent_error = "" if is_silent else error.detail
            return self._tell("iot_agent", error)
        monitor.agent_slow = _slow(clock.now().mono - before.mono)
        if self._agent_trouble:
            monitor.agent_error = monitor.agent_silent = ""
            self._unanswered_until = 0.0
            self._gap.set()
        return self._tell("iot_agent", None)

    @property
    def _agent_trouble(self) -> str:
        return self._health_monitor.agent_error or self._health_monitor.agent_silent

    # --- devices, subscriptions, reads --------------------------------------------

    async def _repair(self) -> bool:
        """Devices, then subscriptions, then the read that fills the gap.

        Orion sends nothing when a subscription is made, so the read comes last.
        """
        self._gap.clear()
        devices = self._devices_are_due(clock.now())
        if self._health_monitor.orion_error:
            return False
        is_whole = True
        if devices and not self._agent_trouble:
            is_whole = await self._try("devices", "iot_agent", self._check_devices)
        for what, work in (
            ("subscriptions", self._check_subscriptions),
            ("reading", self._read_robots),
        ):
            is_whole = await self._try(what, "orion", work) and is_whole
        return is_whole and not self._agent_trouble

    def _devices_are_due(self, now: Instant) -> bool:
        """Never while the agent falls behind: the questions would queue there too."""
        monitor = self._health_monitor
        if monitor.is_overloaded(now) or now.mono < self._unanswered_until:
            return False
        return now.mono >= self._devices_at or not monitor.whole(now)

    async def _try(
        self, what: str, hop: str, work: Callable[[], Awaitable[None]]
    ) -> bool:
        """Do one part; a neighbour that is down was reported already."""
        try:
            await work()
        except HopError as error:
            failure = error
        except (AttributeError, KeyError, TypeError, ValueError):
            # The shape of a neighbour's JSON is known only by use.
            failure = HopError(hop, MEANINGLESS)
        else:
            return self._tell(what, None)
        if what == "devices":
            self._health_monitor.agent_warning = failure.detail
            if isinstance(failure, NoAnswerError):
                self._unanswered_until = clock.now().mono + _UNANSWERED_S
        elif what == "subscriptions":
            self._health_monitor.notify_error = failure.detail
        ask = self._ask_agent if failure.hop == "iot_agent" else self._ask_orion
        return await ask() and self._tell(what, failure)

    async def _check_devices(self) -> None:
        self._devices_at = clock.now().mono + _DEVICES_PERIOD_S
        done = await provision(self._agent, self._orion, self._site)
        _explain(done.mended)
        # What only a person can mend stands on the health page while it lasts.
        self._health_monitor.agent_warning = _in_short(done.problems)

    async def _check_subscriptions(self) -> None:
        site, monitor = self._site, self._health_monitor
        self._is_subscribing = True
        try:
            done = await ensure_subscriptions(
                self._orion,
                site.notify_url,
                site.notify_token,
                wanted_for(site.tiles, site.scanned),
            )
        finally:
            self._is_subscribing = False
        # What is made at the start was never missed.
        missed = _in_short(done.mended) if self.subscription_ids else ""
        self.subscription_ids = done.ids
        self._former_secrets |= done.former_secrets
        _explain(done.mended)
        monitor.notify_detail, monitor.notify_error = done.failing, missed
        if missed:
            raise HopError("notifications", missed)

    async def _read_robots(self) -> None:
        """Read all robots, to restore what a gap has lost."""
        entities = await self._orion.read_robots()
        at = clock.now()
        for entity in entities:
            for observation in codec.read_entity(entity).observations:
                if observation.robot_id in self._site.robots:
                    self._ingest.enqueue(
                        Received(observation, at, FIWARE.id, asked=True)
                    )

    def _tell(self, what: str, error: HopError | None) -> bool:
        """Log a loss once and a return once; says whether all is well."""
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
    """For ever: sooner after a gap, ever later while it does not succeed."""
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


def _explain(mended: Sequence[str]) -> None:
    for sentence in mended:
        _log.info("%s", sentence)


def _in_short(sentences: Sequence[str]) -> str:
    more = f" And {len(sentences) - 1} more." if len(sentences) > 1 else ""
    return sentences[0] + more if sentences else ""


def _slow(spent_s: float) -> str:
    """Problem that a response time shows (s); empty for none."""
    return f"answers take {spent_s:.1f} s" if spent_s > SLOW_S else ""
