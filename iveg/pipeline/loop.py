"""The rule loop: takes arrived observations, lets time pass, is the only heartbeat.

If this loop hangs, feedback stops and every robot slows down by itself (fault F14).
"""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from itertools import chain

from iveg.domain.events import LogEvent
from iveg.domain.kinds import kind
from iveg.domain.observations import (
    CommandAnswer,
    GoalAnswer,
    HeartbeatProbe,
    Instant,
    Received,
    kind_of,
)
from iveg.domain.transports import TransportId
from iveg.pipeline import topics
from iveg.pipeline.command import Commander
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.event_log import EventLog
from iveg.pipeline.health_monitor import HealthMonitor, HopHealth, HopState
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.ports import Clock
from iveg.pipeline.steps import Step
from iveg.pipeline.supervision import Supervision

TICK_S = 0.05
_ANSWERS = (CommandAnswer, GoalAnswer)
APART_S = 0.0001
"""Least time between two takings for each robot of the fleet: 2 ms with twenty."""
JUDGED_APART_S = 10 * APART_S
"""The same between two judgements: 2 ms with two robots, 10 ms with ten.

A judgement costs as much for one message as for ten, and poses wait behind it.
"""
_LATEST_APART_S = JUDGED_APART_S + APART_S / 2
_MOST_TAKINGS = 3
"""What came meanwhile is taken before a judgement, too, but none waits for ever."""
_HEALTH_PERIOD_S = 1.0
_WORTH_S = 0.001
"""A shorter wait costs more than it saves."""
Recorded = tuple[Callable[[Instant, Step], None], Callable[[Instant], None]]
"""Called with each step, and after each tick."""


def reading_apart_s(robots: int) -> float:
    """Least time between two readings of the broker (s): taken is what was read."""
    apart_s = APART_S * robots
    return apart_s if apart_s > _WORTH_S else 0.0


class RuleLoop:
    """Runs ingest, assess and command in one order, in one task.

    Args:
        supervision: Names what of comfort is down.
        decided: Comfort that measures: called with what a judgement was made of.
        ticks: Comfort that lets time pass, called with each tick; all of it guarded.
        goals: Comfort, likewise: called with each new word on a goal; with each tick.
        recorded: Comfort that writes down what was done: called with each step before
            it is taken, and with its kind; and after each tick.
    """

    def __init__(
        self,
        ingest: Ingest,
        evaluator: Evaluator,
        commander: Commander,
        health_monitor: HealthMonitor,
        event_log: EventLog,
        clock: Clock,
        supervision: Supervision,
        decided: Callable[[Iterable[Received], Instant], None],
        ticks: Sequence[Callable[[Instant], None]],
        goals: tuple[
            Callable[[GoalAnswer, Instant, TransportId], None],
            Callable[[Instant], None],
        ],
        recorded: Recorded,
    ) -> None:
        self._ingest = ingest
        self._evaluator = evaluator
        self._commander = commander
        self._health_monitor = health_monitor
        self._event_log = event_log
        self._clock = clock
        self._supervision = supervision
        self._decided = decided
        self._goal_heard, tick_goals = goals
        self._ticks = (tick_goals, *ticks)
        self._stepped, self._write_down = recorded
        self._ticked = float("-inf")
        self._is_aged = self._is_unwritten = False
        self._health_at = float("-inf")
        self._taken: list[Received] = []
        """Observations taken since the last judgement."""
        self._states: dict[str, HopState] = {}
        self._broken: set[str] = set()

    async def run(self) -> None:
        """Until cancelled."""
        taken_at = judged_at = float("-inf")
        robots = len(self._evaluator.world.robots)
        while True:
            waits_s = TICK_S
            if self._evaluator.is_unjudged:
                # The next taking judges; by itself only what none comes after.
                waits_s = judged_at + _LATEST_APART_S * robots - self._clock().mono
            await self._ingest.wait(max(0.0, waits_s))
            # What comes close together is taken together.
            early = taken_at + APART_S * robots - self._clock().mono
            if early > _WORTH_S:
                await asyncio.sleep(early)
            now = self._clock()
            if self._ingest.waiting:
                taken_at = now.mono
            judges = now.mono - judged_at >= JUDGED_APART_S * robots - _WORTH_S
            ticks = self._ticks_at(now)
            await self._take()
            if ticks:
                self.age(self._clock())
                await self._take(late=True)
            if judges or ticks:
                judged_at = now.mono
                # The past takes whatever came before a step, so this does, too.
                self.advance(self._ingest.drain(), self._clock())
                if self._is_unwritten:
                    await self._take(late=True)
                    # No message may be heard before this and taken after it.
                    self.step(self._ingest.drain(), self._clock(), judges=False)

    async def _take(self, *, late: bool = False) -> None:
        """Take what waits, and let pages be shown it before anything else is done.

        ``late``: after something long, of which readers may have waited for the end.
        """
        if late:
            await asyncio.sleep(0)
        for _ in range(_MOST_TAKINGS):
            arrived = list(self._ingest.drain())
            if not arrived:
                return
            self.advance(arrived, self._clock(), judges=False)
            await asyncio.sleep(0)

    def step(
        self, arrived: Iterable[Received], now: Instant, *, judges: bool = True
    ) -> None:
        """Advance, and write down what was done if time has passed since it was."""
        self.advance(arrived, now, judges=judges)
        if self._is_unwritten:
            self._is_unwritten = False
            self._write_down(now)

    def advance(
        self, arrived: Iterable[Received], now: Instant, *, judges: bool = True
    ) -> None:
        """Take everything that arrived.

        ``judges``: and judge the fleet, and let time pass if it is due; else the next
        step that judges does.
        """
        self._stepped(now, Step.JUDGED if judges else Step.TAKEN)
        for received in arrived:
            self._hear(received)
        ticks = judges and (self._is_aged or self._ticks_at(now))
        if ticks:
            self._tick(now)
        elif judges:
            self._evaluator.settle()
        if self._taken and not self._evaluator.is_unjudged:
            self._decided(self._taken, self._clock())
            self._taken.clear()
        if ticks:
            self._watch_chain(now)
            for tick in self._ticks:
                tick(now)
            self._is_unwritten = True

    def age(self, now: Instant) -> None:
        """Let the world grow older before the step that judges it.

        By itself, so that what arrives meanwhile waits for one of the two.
        """
        self._stepped(now, Step.AGED)
        self._grow_older(now)

    def _grow_older(self, now: Instant) -> None:
        # Ticks are counted from here, however long it takes.
        self._ticked, self._is_aged = now.mono, True
        self._evaluator.age(now)

    def _ticks_at(self, now: Instant) -> bool:
        return now.mono - self._ticked >= TICK_S - 1e-3

    def _hear(self, received: Received) -> None:
        fresh = self._apply(received)
        if fresh:
            self._taken.append(received)
        if isinstance(received.observation, HeartbeatProbe):
            self._health_monitor.received(received.observation.origin, received.at)
        # The second transport's answer is no news, but its time is kept.
        if not fresh and not isinstance(received.observation, _ANSWERS):
            return
        if self._evaluator.world.may_act(received):
            self._act(received)

    def _tick(self, now: Instant) -> None:
        """Let time pass for what is vital; the fleet is judged with it."""
        self._commander.tick(now)
        if not self._is_aged:
            self._grow_older(now)
        self._is_aged = False
        commanded = self._commander.conditions(now)
        supervised = self._supervision.conditions(now)
        self._evaluator.tick(now, chain(commanded, supervised))

    def _act(self, received: Received) -> None:
        """Hand an observation to whoever follows an order."""
        observation = received.observation
        if isinstance(observation, GoalAnswer):
            self._goal_heard(observation, received.at, received.transport)
        else:
            age_s = self._evaluator.world.age_then(received)
            self._commander.apply(received, age_s)

    def _apply(self, received: Received) -> bool:
        """Whether it became part of the state.

        What only comfort reads is refused where it fails, and hurts no neighbour.
        """
        observation = received.observation
        try:
            return self._evaluator.apply(received)
        except Exception as error:
            if kind(observation).vital:
                raise
            source, of = observation.robot_id or "?", kind_of(observation)
            self._ingest.reject(source, f"unusable_{of.__name__}", repr(error))
            return False

    def _watch_chain(self, now: Instant) -> None:
        hops = self._health_monitor.hops(now)
        for hop in hops:
            self._log_change(hop, now)
        before, self._states = self._states, {hop.name: hop.state for hop in hops}
        overdue = now.mono - self._health_at >= _HEALTH_PERIOD_S
        if overdue or self._states != before:
            self._health_at = now.mono
            self._event_log.changed(topics.HEALTH.name)

    def _log_change(self, hop: HopHealth, now: Instant) -> None:
        """A loss once, and its end once; what is merely late or unknown is neither."""
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
