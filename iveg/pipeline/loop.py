"""The rule loop: takes what has arrived, lets time pass, and is the only heartbeat.

If this loop hangs, feedback stops and every robot slows down by itself (fault F14).
"""

import asyncio
from collections.abc import Callable, Iterable

from iveg.domain.events import LogEvent
from iveg.domain.observations import CommandAnswer, HeartbeatProbe, Instant, Received
from iveg.pipeline import topics
from iveg.pipeline.command import Commander
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.health_monitor import HealthMonitor, Hop, HopState
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.latency import LatencyMonitor
from iveg.pipeline.ports import Clock
from iveg.pipeline.publish import Hub

TICK_S = 0.05
APART_S = 0.00025
"""Least time between two judgements for each robot of the fleet: 5 ms with twenty."""
_HEALTH_PERIOD_S = 1.0


class RuleLoop:
    """Runs ingest, assess and command in one order, in one task."""

    def __init__(
        self,
        ingest: Ingest,
        evaluator: Evaluator,
        commander: Commander,
        health_monitor: HealthMonitor,
        event_log: EventLog,
        hub: Hub,
        clock: Clock,
        database_state: Callable[[], HopState],
        latency: LatencyMonitor,
    ) -> None:
        self._ingest = ingest
        self._evaluator = evaluator
        self._commander = commander
        self._health_monitor = health_monitor
        self._event_log = event_log
        self._hub = hub
        self._clock = clock
        self._database_state = database_state
        self._latency = latency
        self._apart_s = APART_S * len(evaluator.world.robots)
        self._ticked = float("-inf")
        self._health_at = float("-inf")
        self._states: dict[str, HopState] = {}
        self._broken: set[str] = set()

    async def run(self) -> None:
        """Until cancelled."""
        taken_at = float("-inf")
        while True:
            await self._ingest.wait(TICK_S)
            # What comes close together is judged together.
            early = taken_at + self._apart_s - self._clock().mono
            if early > 0.0:
                await asyncio.sleep(early)
            now = self._clock()
            taken_at = now.mono
            self.step(self._ingest.drain(), now)

    def step(self, arrived: Iterable[Received], now: Instant) -> None:
        """Take everything that arrived, then let time pass if it is due."""
        taken = []
        for received in arrived:
            fresh = self._evaluator.take(received)
            if fresh:
                taken.append(received)
            if isinstance(received.observation, HeartbeatProbe):
                self._health_monitor.received(received.observation.origin, received.at)
            if received.asked or self._evaluator.world.refuses(received):
                continue
            # The second transport's answer is no news, but its time is kept.
            if fresh or isinstance(received.observation, CommandAnswer):
                self._commander.take(received, self._evaluator.world.age_then(received))
        self._evaluator.settle()
        if taken:
            self._latency.decided(taken, self._clock())
        if now.mono - self._ticked >= TICK_S - 1e-3:
            self._ticked = now.mono
            self._commander.tick(now)
            self._evaluator.tick(now, self._commander.conditions(now))
            self._watch_chain(now)
            self._latency.tick(now)

    def _watch_chain(self, now: Instant) -> None:
        self._health_monitor.received_at = self._evaluator.world.heartbeat_at
        self._health_monitor.database = self._database_state()
        changed = False
        for hop in self._health_monitor.hops(now):
            if hop.state == self._states.get(hop.name):
                continue
            self._states[hop.name] = hop.state
            changed = True
            self._tell(hop, now)
        if changed or now.mono - self._health_at >= _HEALTH_PERIOD_S:
            self._health_at = now.mono
            self._hub.changed(topics.HEALTH.name)

    def _tell(self, hop: Hop, now: Instant) -> None:
        """A loss once, and its end once; what is merely late or unknown is neither."""
        if hop.state == "down" and hop.name not in self._broken:
            self._broken.add(hop.name)
            key = "log.hop.down"
        elif hop.state == "ok" and hop.name in self._broken:
            self._broken.remove(hop.name)
            key = "log.hop.back"
        else:
            return
        slots = {"hop": hop.name, "detail": hop.detail}
        self._event_log.log(LogEvent("system", key, slots), now)
