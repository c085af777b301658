"""Provisioner: keeps the FIWARE data path working by itself.

Devices and subscriptions are made at the start and checked for ever; after a gap one
read of all robots brings the world up to date; a probe measure goes out every two
seconds, because only its return proves that the path works.

Three tasks run beside each other, so that none of them waits for a slow neighbour: the
probe, a short question to Orion and to the agent, and the repairs.
"""

import asyncio
import logging
import random
from collections.abc import Awaitable, Callable, Iterable, Sequence
from typing import TypeVar

from iveg.adapters.fleet_provisioning import Provisioned, provision
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.mqtt import MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.subscriptions import Ensured, ensure_subscriptions, wanted_for
from iveg.domain.equipment import Tile
from iveg.domain.errors import HopError, NoAnswerError
from iveg.domain.observations import HeartbeatProbe, Instant, Origin, Received
from iveg.domain.transports import FIWARE
from iveg.ngsi import codec, names
from iveg.vital.health_monitor import PROBE_PERIOD_S, HealthMonitor, Pace
from iveg.vital.ingest import Ingest

_log = logging.getLogger(__name__)
_ASK_PERIOD_S, _REPAIR_PERIOD_S = 1.0, 4.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.5, 3.0
_LONGEST_DEVICES_WAIT_S = 32.0
_DEVICES_EVERY = 3
"""While all is well, devices are looked at every third time."""

T = TypeVar("T")


class Provisioner:
    """Provisioning, subscriptions, reconciling reads and the heartbeat probe.

    Args:
        tiles: Of other equipment.
    """

    def __init__(
        self,
        orion: OrionClient,
        agent: IotAgentClient,
        link: MqttLink,
        health_monitor: HealthMonitor,
        ingest: Ingest,
        *,
        robots: Sequence[str],
        apikey: str,
        context_broker_url: str,
        notify_url: str,
        notify_token: str,
        boot: str,
        read_clock: Callable[[], Instant],
        tiles: Sequence[Tile] = (),
    ) -> None:
        self._orion = orion
        self._agent = agent
        self._link = link
        self._health_monitor = health_monitor
        self._ingest = ingest
        self._robots = robots
        self._tiles = tiles
        self._apikey = apikey
        self._context_broker_url = context_broker_url
        self._notify_url = notify_url
        self._notify_token = notify_token
        self._boot = boot
        self._clock = read_clock
        self._probe_seq = 0
        self._devices_at = self._devices_wait_s = 0.0
        self._paces = {"orion": Pace(), "iot_agent": Pace()}
        self._broken: set[str] = set()
        self._warned: frozenset[str] = frozenset()
        self._gap = asyncio.Event()
        self._subscription_ids: frozenset[str] = frozenset()
        self._former_ids: frozenset[str] = frozenset()
        self._former_secrets: frozenset[str] = frozenset()
        self._is_subscribing = False

    @property
    def subscription_ids(self) -> frozenset[str]:
        """Ids of our subscriptions."""
        return self._subscription_ids

    def is_ours(self, subscription_id: str) -> bool:
        """Whether a notification is one that was asked for.

        Orion may notify of a subscription before it has said its id, and after a
        restart of ours of those that were made before: while some are made, and until
        the first are known, each that brings our secret is ours.
        """
        return (
            subscription_id in self._subscription_ids
            or subscription_id in self._former_ids
            or self._is_subscribing
            or not self._subscription_ids
        )

    def is_former(self, secret: str) -> bool:
        """Whether a secret may be that of an earlier start, which Orion still brings.

        Until Orion has said which subscriptions have our name, any may be.
        """
        return secret in self._former_secrets or not self._subscription_ids

    async def run(self) -> None:
        """Until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._send_probes(), name="probe")
            tasks.create_task(self._watch(self._ask_orion), name="watch-orion")
            tasks.create_task(self._watch(self._ask_agent), name="watch-agent")
            tasks.create_task(self._look_after(), name="look-after")

    # --- the heartbeat probe --------------------------------------------------------

    async def _send_probes(self) -> None:
        """At QoS 1: a broker that is there and does nothing says nothing either."""
        topic = names.measure_topic(self._apikey, names.HEARTBEAT_ID)
        while True:
            if not self._link.connected:
                self._health_monitor.mqtt_error = ""
                await asyncio.sleep(0.1)
                continue
            self._probe_seq += 1
            now = self._clock()
            stamp = codec.format_stamp(now.wall)
            origin = Origin(self._boot, self._probe_seq, stamp)
            self._health_monitor.sent(origin, now)
            self._health_monitor.mqtt_error = await self._publish(topic, origin)
            spent = self._clock().mono - now.mono
            await asyncio.sleep(max(0.1, PROBE_PERIOD_S - spent))

    async def _publish(self, topic: str, origin: Origin) -> str:
        """The broker's complaint about a probe; empty when it takes it."""
        try:
            await self._link.publish(topic, codec.write_heartbeat(origin))
        except HopError:
            return "takes messages and does not confirm them"
        return ""

    # --- short questions ----------------------------------------------------------

    async def _watch(self, ask: Callable[[], Awaitable[bool]]) -> None:
        pause = _FIRST_PAUSE_S
        while True:
            if await ask():
                pause = _FIRST_PAUSE_S
                await asyncio.sleep(_ASK_PERIOD_S)
            else:
                await asyncio.sleep(_jittered(pause))
                pause = min(_LONGEST_PAUSE_S, 2 * pause)

    async def _ask_orion(self) -> bool:
        """Prove that Orion answers, and how far the probe came."""
        before = self._clock()
        try:
            entity = await self._orion.read_probe()
        except HopError as error:
            self._health_monitor.orion_error = error.detail
            return self._tell("orion", error)
        at = self._clock()
        self._health_monitor.orion_ok_at = at.mono
        self._health_monitor.orion_slow = self._slow("orion", at.mono - before.mono)
        for observation in codec.read_entity(entity).observations if entity else ():
            if isinstance(observation, HeartbeatProbe):
                self._health_monitor.stored(observation.origin)
        if self._health_monitor.orion_error:
            self._health_monitor.orion_error = ""
            self._health_monitor.orion_back_at = at.mono
            self._gap.set()
        return self._tell("orion", None)

    async def _ask_agent(self) -> bool:
        before = self._clock()
        try:
            await self._agent.version()
        except HopError as error:
            is_silent = isinstance(error, NoAnswerError)
            self._health_monitor.agent_silent = error.detail if is_silent else ""
            self._health_monitor.agent_error = "" if is_silent else error.detail
            return self._tell("iot_agent", error)
        spent = self._clock().mono - before.mono
        self._health_monitor.agent_slow = self._slow("iot_agent", spent)
        if self._agent_trouble:
            self._health_monitor.agent_error = self._health_monitor.agent_silent = ""
            self._devices_wait_s = self._devices_at = 0.0
            self._gap.set()
        return self._tell("iot_agent", None)

    @property
    def _agent_trouble(self) -> str:
        return self._health_monitor.agent_error or self._health_monitor.agent_silent

    def _slow(self, hop: str, spent_s: float) -> str:
        pace = self._paces[hop]
        detail = pace.took(spent_s)
        self._tell(f"{hop}'s speed", HopError(hop, detail) if pace.is_fault else None)
        return detail

    # --- devices, subscriptions, reads --------------------------------------------

    async def _look_after(self) -> None:
        """Repair for ever; sooner after a gap, ever later while it does not succeed."""
        rounds, pause = 0, _FIRST_PAUSE_S
        while True:
            self._gap.clear()
            devices = self._devices_are_due(rounds, self._clock())
            rounds += 1
            if await self._repair(devices=devices):
                pause = _FIRST_PAUSE_S
                await self._rest(_REPAIR_PERIOD_S)
            else:
                await self._rest(_jittered(pause))
                pause = min(_LONGEST_PAUSE_S, 2 * pause)

    def _devices_are_due(self, rounds: int, now: Instant) -> bool:
        """Never while the agent falls behind: the questions would queue there too."""
        if self._health_monitor.is_overloaded(now) or now.mono < self._devices_at:
            return False
        return rounds % _DEVICES_EVERY == 0 or not self._health_monitor.whole(now)

    async def _rest(self, seconds: float) -> None:
        """Sleep, unless a neighbour comes back meanwhile."""
        try:
            async with asyncio.timeout(seconds):
                await self._gap.wait()
        except TimeoutError:
            return

    async def _repair(self, *, devices: bool) -> bool:
        """Devices, then subscriptions, then the read that fills the gap.

        Orion sends nothing when a subscription is made, so the read comes last.
        """
        if self._health_monitor.orion_error:
            return False
        whole = True
        if devices and not self._agent_trouble:
            whole = await self._check_devices()
        whole = await self._check_subscriptions() and whole
        return await self._reconcile() and whole and not self._agent_trouble

    async def _check_devices(self) -> bool:
        work = provision(
            self._agent,
            self._orion,
            robots=self._robots,
            apikey=self._apikey,
            cbroker_url=self._context_broker_url,
            tiles=self._tiles,
        )
        try:
            done: Provisioned = await _made_sense("iot_agent", work)
        except HopError as error:
            self._health_monitor.agent_warning = error.detail
            if isinstance(error, NoAnswerError):
                self._wait_longer()
            return await self._blame("devices", error)
        self._devices_wait_s = self._devices_at = 0.0
        self._explain(done.mended)
        self._warn(done.problems)
        return self._tell("devices", None)

    def _wait_longer(self) -> None:
        """Repeat an unanswered question ever later: it may still be queued."""
        longer = max(_REPAIR_PERIOD_S, 2 * self._devices_wait_s)
        self._devices_wait_s = min(_LONGEST_DEVICES_WAIT_S, longer)
        self._devices_at = self._clock().mono + self._devices_wait_s

    async def _check_subscriptions(self) -> bool:
        work = ensure_subscriptions(
            self._orion,
            self._notify_url,
            self._notify_token,
            wanted_for(self._tiles),
        )
        self._is_subscribing = True
        try:
            done: Ensured = await _made_sense("orion", work)
        except HopError as error:
            self._health_monitor.notify_error = error.detail
            return await self._blame("subscriptions", error)
        finally:
            self._is_subscribing = False
        first = not self._subscription_ids
        self._subscription_ids = done.ids
        self._former_ids |= done.former_ids
        self._former_secrets |= done.former_secrets
        self._explain(done.mended)
        self._health_monitor.notify_detail = done.failing
        # What is made at the start was never missed.
        missed = "" if first else _in_short(done.mended)
        self._health_monitor.notify_error = missed
        trouble = HopError("notifications", missed) if missed else None
        return self._tell("subscriptions", trouble)

    async def _reconcile(self) -> bool:
        """Read all robots, to restore what a gap has lost."""
        try:
            await _made_sense("orion", self._read_robots())
        except HopError as error:
            return await self._blame("reading", error)
        return self._tell("reading", None)

    async def _blame(self, what: str, error: HopError) -> bool:
        """Report a failure; a neighbour that is down was reported already."""
        ask = self._ask_agent if error.hop == "iot_agent" else self._ask_orion
        return await ask() and self._tell(what, error)

    async def _read_robots(self) -> None:
        entities = await self._orion.read_robots()
        at = self._clock()
        for entity in entities:
            for observation in codec.read_entity(entity).observations:
                if observation.robot_id in self._robots:
                    self._ingest.enqueue(
                        Received(observation, at, FIWARE.id, asked=True)
                    )

    # --- log ----------------------------------------------------------------------

    def _explain(self, mended: Iterable[str]) -> None:
        for sentence in mended:
            _log.info("%s", sentence)

    def _warn(self, problems: Sequence[str]) -> None:
        """Show what only a person can mend on the health page, while it lasts."""
        self._health_monitor.agent_warning = _in_short(problems)
        for sentence in problems:
            if sentence not in self._warned:
                _log.warning("%s", sentence)
        self._warned = frozenset(problems)

    def _tell(self, what: str, error: HopError | None) -> bool:
        """Log a loss once and a return once; says whether all is well."""
        if error is not None and what not in self._broken:
            self._broken.add(what)
            _log.warning("%s: not as it should be: %s", what, error)
        elif error is None and what in self._broken:
            self._broken.discard(what)
            _log.info("%s: well again", what)
        return error is None


async def _made_sense(hop: str, work: Awaitable[T]) -> T:
    """Run the reader of a neighbour's JSON, whose shape is known only by use."""
    try:
        return await work
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise HopError(hop, "answered JSON that means nothing here") from error


def _in_short(sentences: Sequence[str]) -> str:
    more = f" And {len(sentences) - 1} more." if len(sentences) > 1 else ""
    return sentences[0] + more if sentences else ""


def _jittered(pause_s: float) -> float:
    return pause_s * random.uniform(0.5, 1.0)  # noqa: S311 - jitter, no secret
