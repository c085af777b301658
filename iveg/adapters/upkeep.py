"""Keeps the FIWARE chain whole with no hand on it.

Devices and subscriptions are made at the start and looked after for ever; after a gap
one read of all robots brings the world up to date; a canary measure goes out every two
seconds, because only what comes back proves that the chain is alive.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Sequence

from iveg.adapters.iot_agent import IotAgentClient, provision
from iveg.adapters.mqtt import MqttLink
from iveg.adapters.orion import OrionClient
from iveg.adapters.subscriptions import ensure_subscriptions
from iveg.domain.errors import HopError
from iveg.domain.observations import Instant, Origin, Received
from iveg.ngsi import codec, names
from iveg.pipeline.chain import CANARY_PERIOD_S, Chain
from iveg.pipeline.ingest import Ingest

_log = logging.getLogger(__name__)
_CHECK_PERIOD_S, _RETRY_S = 5.0, 1.0
_HOUSEKEEPING_EVERY = 2
"""Devices and subscriptions are looked at every second check."""


class Upkeep:
    """Provisioning, subscriptions, reconciling reads and the canary.

    Attributes:
        subscription_ids: The subscriptions that are ours.
    """

    def __init__(
        self,
        orion: OrionClient,
        agent: IotAgentClient,
        link: MqttLink,
        chain: Chain,
        ingest: Ingest,
        *,
        robots: Sequence[str],
        apikey: str,
        context_broker_url: str,
        notify_url: str,
        notify_token: str,
        boot: str,
        read_clock: Callable[[], Instant],
    ) -> None:
        self._orion = orion
        self._agent = agent
        self._link = link
        self._chain = chain
        self._ingest = ingest
        self._robots = robots
        self._apikey = apikey
        self._context_broker_url = context_broker_url
        self._notify_url = notify_url
        self._notify_token = notify_token
        self._boot = boot
        self._clock = read_clock
        self._canary_seq = 0
        self._broken: set[str] = set()
        self.subscription_ids: frozenset[str] = frozenset()

    async def run(self) -> None:
        """Until cancelled."""
        async with asyncio.TaskGroup() as tasks:
            tasks.create_task(self._sing(), name="canary")
            tasks.create_task(self._look_after(), name="look-after")

    # --- the canary ---------------------------------------------------------------

    async def _sing(self) -> None:
        topic = names.measure_topic(self._apikey, names.CANARY_ID)
        while True:
            self._canary_seq += 1
            stamp = codec.format_stamp(self._clock().wall)
            origin = Origin(self._boot, self._canary_seq, stamp)
            self._link.offer(topic, codec.write_canary(origin))
            await asyncio.sleep(CANARY_PERIOD_S)

    # --- devices, subscriptions, reads --------------------------------------------

    async def _look_after(self) -> None:
        """Check all along; while something is broken check more often."""
        checks = 0
        while True:
            whole = await self._check_orion()
            if not self._chain_whole() or checks % _HOUSEKEEPING_EVERY == 0:
                whole = await self._check_agent() and whole
                whole = await self._check_subscriptions() and whole
            checks += 1
            await asyncio.sleep(_CHECK_PERIOD_S if whole else _RETRY_S)

    def _chain_whole(self) -> bool:
        return all(
            hop.state == "ok"
            for hop in self._chain.hops(self._clock())
            if hop.name != "database"
        )

    async def _check_orion(self) -> bool:
        """Read all robots: proves Orion and mends what a gap has lost."""
        try:
            entities = await self._orion.read_robots()
        except HopError as error:
            self._chain.orion_error = error.detail
            return self._tell("orion", error)
        at = self._clock()
        self._chain.orion_error = ""
        self._chain.orion_ok_at = at.mono
        for entity in entities:
            for observation in codec.read_entity(entity).observations:
                if getattr(observation, "robot_id", None) in self._robots:
                    self._ingest.offer(Received(observation, at, "orion", asked=True))
        return self._tell("orion", None)

    async def _check_agent(self) -> bool:
        try:
            done = await provision(
                self._agent,
                self._orion,
                robots=self._robots,
                apikey=self._apikey,
                cbroker_url=self._context_broker_url,
            )
        except HopError as error:
            self._chain.agent_error = error.detail
            return self._tell("iot_agent", error)
        self._chain.agent_error = ""
        self._explain(done.mended, done.problems)
        return self._tell("iot_agent", None)

    async def _check_subscriptions(self) -> bool:
        try:
            done = await ensure_subscriptions(
                self._orion, self._notify_url, self._notify_token
            )
        except HopError as error:
            return self._tell("subscriptions", error)
        self.subscription_ids = frozenset(done.ids)
        self._explain(done.mended)
        return self._tell("subscriptions", None)

    def _explain(self, mended: Iterable[str], problems: Iterable[str] = ()) -> None:
        for sentence in mended:
            _log.info("%s", sentence)
        for sentence in problems:
            if sentence not in self._broken:
                self._broken.add(sentence)
                _log.warning("%s", sentence)

    def _tell(self, hop: str, error: HopError | None) -> bool:
        """Log a loss once and a return once; says whether all is well."""
        if error is not None and hop not in self._broken:
            self._broken.add(hop)
            _log.warning("%s is not as it should be: %s", hop, error)
        elif error is None and hop in self._broken:
            self._broken.discard(hop)
            _log.info("%s is back", hop)
        return error is None
