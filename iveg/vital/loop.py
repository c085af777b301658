"""The rule loop: takes arrived observations, lets time pass, is the only heartbeat.

If this loop hangs, feedback stops and every robot slows down by itself (fault F14).
"""

import asyncio
from collections.abc import Iterable
from itertools import chain

from iveg.domain.events import LogEvent
from iveg.domain.kinds import kind
from iveg.domain.motion import UNMOVED
from iveg.domain.observations import (
    CommandAnswer,
    GoalAnswer,
    HeartbeatProbe,
    Instant,
    Received,
    kind_of,
)
from iveg.domain.stream_order import Freshness
from iveg.vital import topics
from iveg.vital.command import Commander
from iveg.vital.core import Core
from iveg.vital.evaluate import Evaluator
from iveg.vital.health_monitor import HopHealth, HopState
from iveg.vital.ingest import Ingest

TICK_S = 0.05
"""Period in which time passes for the world, and the fleet is judged (s)."""
APART_S = 0.02
"""Least time between two judgements; else news are judged at once (s)."""
_SHARE = 8
"""Judging takes an eighth of the time at most, so that messages do not pile up."""
# A timer may wake a little early, which must not cost a second turn.
_EARLY_S = 0.001
_ANSWERS = (CommandAnswer, GoalAnswer)
_TWINS: tuple[Freshness, ...] = ("duplicate", "late")
_HEALTH_PERIOD_S = 1.0


class RuleLoop:
    """Runs ingest, assess and command in one order, in one task."""

    def __init__(
        self, core: Core, ingest: Ingest, evaluator: Evaluator, commander: Commander
    ) -> None:
        self._ingest, self._evaluator, self._commander = ingest, evaluator, commander
        self._health_monitor, self._event_log = core.health_monitor, core.event_log
        self._clock, self._supervision = core.ports.clock, core.supervision
        self._ticked = self._judged = float("-inf")
        self._took_s = 0.0
        """Duration of the last judgement."""
        self._health_at = float("-inf")
        self._taken: list[Received] = []
        """Observations taken since the last judgement."""
        self._states: dict[str, HopState] = {}
        self._broken: set[str] = set()

    async def run(self) -> None:
        """Run until cancelled; the only loop."""
        while True:
            await self._ingest.wait(max(0.0, self._due_at - self._clock().mono))
            self.take(self._ingest.drain())
            # Yield, so that pages are sent the news before the fleet is judged by them.
            await asyncio.sleep(0)
            now = self._clock()
            if now.mono >= self._due_at:
                self.judge(now)
                self._took_s = self._clock().mono - now.mono

    @property
    def _due_at(self) -> float:
        """Moment of the next judgement (monotonic, s)."""
        ticks_at = self._ticked + TICK_S - _EARLY_S
        if not self._evaluator.is_unjudged:
            return ticks_at
        return min(ticks_at, self._judged + max(APART_S, _SHARE * self._took_s))

    def step(self, arrived: Iterable[Received], now: Instant) -> None:
        """Take everything that arrived, and judge the fleet."""
        self.take(arrived)
        self.judge(now)

    def take(self, arrived: Iterable[Received]) -> None:
        """Take everything that arrived; the next judgement counts it."""
        for received in arrived:
            self._take_in(received)

    def judge(self, now: Instant) -> None:
        """Judge the fleet once for all that was taken; let time pass if it is due."""
        self._judged = now.mono
        ticks = now.mono - self._ticked >= TICK_S - _EARLY_S
        if ticks:
            self._ticked = now.mono
            self._tick(now)
        else:
            self._evaluator.settle()
        if self._taken:
            self._supervision.tell("decided", self._taken, self._clock())
            self._taken.clear()
        if ticks:
            self._watch_chain(now)
            self._supervision.tell("ticked", now)

    def _take_in(self, received: Received) -> None:
        freshness = self._apply(received)
        if freshness == "new":
            self._taken.append(received)
        if isinstance(received.observation, HeartbeatProbe):
            self._health_monitor.received(received.observation.origin, received.at)
        # The second transport's answer changes nothing, but its time is kept.
        is_twin = isinstance(received.observation, _ANSWERS) and freshness in _TWINS
        if (freshness == "new" or is_twin) and self._evaluator.world.may_act(received):
            self._act(received)

    def _tick(self, now: Instant) -> None:
        """Let time pass for what is vital; the fleet is judged with it."""
        # STOP goes first: its deadlines wait for nothing else.
        self._commander.tick(now)
        self._evaluator.age(now)
        commanded = self._commander.conditions(now)
        supervised = self._supervision.conditions(now)
        self._evaluator.tick(now, chain(commanded, supervised))

    def _act(self, received: Received) -> None:
        """Hand an observation to the part whose order it answers."""
        observation = received.observation
        if isinstance(observation, GoalAnswer):
            facts = observation, received.at, received.transport
            self._supervision.tell("goal_answered", *facts)
        else:
            world = self._evaluator.world
            robot = world.robots.get(observation.robot_id)
            motion = UNMOVED if robot is None else robot.motion(received.at)
            self._commander.apply(received, world.age_then(received), motion)

    def _apply(self, received: Received) -> Freshness:
        """Apply an observation.

        An observation that only comfort reads is refused where it fails, so that it
        harms no other.
        """
        observation = received.observation
        try:
            return self._evaluator.apply(received)
        except Exception as error:
            if kind(observation).vital:
                raise
            source, name = observation.robot_id or "?", kind_of(observation).__name__
            self._ingest.reject(source, f"unusable_{name}", repr(error))
            return "refused"

    def _watch_chain(self, now: Instant) -> None:
        hops = self._health_monitor.hops(now)
        for hop in hops:
            self._log_change(hop, now)
        before, self._states = self._states, {hop.name: hop.state for hop in hops}
        if now.mono - self._health_at >= _HEALTH_PERIOD_S or self._states != before:
            self._health_at = now.mono
            self._event_log.changed(topics.HEALTH.name)

    def _log_change(self, hop: HopHealth, now: Instant) -> None:
        """Log a hop's loss and its end once each; a late or unknown hop is neither."""
        if hop.state == "down" and hop.name not in self._broken:
            self._broken.add(hop.name)
            key = "log.hop.down"
        elif hop.state == "ok" and hop.name in self._broken:
            self._broken.remove(hop.name)
            key = "log.hop.back"
        else:
            return
        slots = {"hop": hop.name.value, "detail": hop.detail}
        self._event_log.log(LogEvent("system", key, slots), now)
