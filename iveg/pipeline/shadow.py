"""A candidate version of the rule that runs beside the one in force: a trial.

It hears the same pictures, walkers and ticks at the same moments, and has people,
rings and crossings of its own over the same world, which it only reads.  It acts on
nothing: no feedback, decision or alert knows of it (``tests/properties/test_shadow``).
What lasers see is taken as it was judged in force, people whom cameras saw left out.
"""

import asyncio
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import count
from typing import Final

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import TrialRefusedError
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import DetectionFrame, Instant
from iveg.domain.rule.crossings import LimitChange
from iveg.domain.rule.obstacles import Walkers
from iveg.domain.rule.speed_limits import SpeedLimits
from iveg.domain.rule.trial import Account, Limits, Trial
from iveg.domain.tracking.laser_sight import LaserSight, ScanOf
from iveg.domain.tracking.people import People
from iveg.domain.tracking.sight import AllClear
from iveg.domain.witness import Plan
from iveg.domain.world import World
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.ports import ChoiceStore, Clock
from iveg.pipeline.rules import Rules
from iveg.pipeline.supervision import Supervision

PART: Final = "shadow-rule"
SAVED_EVERY_S: Final = 30.0
_SETTLES_S: Final = 2.0
"""Until then it may still miss what those in force remember of earlier scans."""


class ShadowRule:
    """Judges by a candidate, and does nothing where there is none.

    Args:
        world: Read, never written.
        newest_scan: Reads a robot's newest scan.
    """

    def __init__(
        self, world: World, greenhouse: Greenhouse, newest_scan: ScanOf
    ) -> None:
        self._world, self._greenhouse = world, greenhouse
        self._newest_scan = newest_scan
        self._running: _Running | None = None

    @classmethod
    def beside(
        cls, evaluator: Evaluator, newest_scan: ScanOf, supervision: Supervision
    ) -> "ShadowRule":
        """One that an evaluator tells what it does; what fails here is its own."""
        shadow = cls(evaluator.world, evaluator.greenhouse, newest_scan)
        evaluator.tracking.taken = supervision.guard(PART, shadow.looked)
        evaluator.aged = supervision.guard(PART, shadow.aged)
        evaluator.judged = supervision.guard(PART, shadow.judged)
        return shadow

    def begin(self, trial: Trial, evaluator: Evaluator, now: Instant) -> None:
        """Begin with what those in force know by now."""
        swept = LaserSight(Plan.of(self._greenhouse), self._newest_scan).swept
        known = evaluator.beginning()
        self._running = _Running(
            self._world, self._greenhouse, trial, *known, AllClear(swept), now
        )

    def end(self) -> None:
        """Forget it."""
        self._running = None

    def trial(self) -> Trial | None:
        """The trial as it stands; None: nothing is tried."""
        return None if self._running is None else self._running.account.trial()

    # --- what the evaluator tells -------------------------------------------------

    def looked(self, frame: DetectionFrame, seen_at: Instant) -> None:
        """A picture was taken in."""
        self._run(lambda one: one.looked(frame, seen_at))

    def aged(self, walkers: Iterable[Walkers], now: Instant) -> None:
        """Time has passed; who walks was seen by lasers."""
        self._run(lambda one: one.aged(walkers, now))

    def judged(
        self,
        rule: DetectionRule,
        limits: Limits,
        changes: Iterable[LimitChange],
        now: Instant,
    ) -> None:
        """The fleet was judged by the version in force."""
        self._run(lambda one: one.judged(rule, limits, changes, now))

    def _run(self, tell: Callable[["_Running"], None]) -> None:
        if self._running is None:
            return
        try:
            tell(self._running)
        except Exception:
            # What it says from here on would be wrong.
            self.end()
            raise


class _Running:
    """One trial, with people and crossings of its own."""

    def __init__(
        self,
        world: World,
        greenhouse: Greenhouse,
        trial: Trial,
        people: People,
        limits: SpeedLimits,
        all_clear: AllClear,
        now: Instant,
    ) -> None:
        self.account = Account(trial)
        self._world, self._greenhouse = world, greenhouse
        self._trial, self._rule = trial, trial.rule
        self._people, self._limits, self._all_clear = people, limits, all_clear
        self._counts_from = now.mono + _SETTLES_S
        self._ids = count()

    def looked(self, frame: DetectionFrame, seen_at: Instant) -> None:
        self._people.sight(frame, self._world, self._rule, seen_at, self._new_id())

    def aged(self, walkers: Iterable[Walkers], now: Instant) -> None:
        self._all_clear.sweep(self._people, self._world, self._greenhouse, now)
        self._people.forget(now)
        for robot_id, at, spots in walkers:
            robot = self._world.robot(robot_id)
            self._people.witness(robot, spots, at, self._new_id())

    def judged(
        self,
        rule: DetectionRule,
        limits: Limits,
        changes: Iterable[LimitChange],
        now: Instant,
    ) -> None:
        would, crossed = self._limits.evaluate(
            self._world, self._people, self._rule, now, self._new_id()
        )
        if now.mono < self._counts_from:
            return
        if not self.account.is_of(rule):
            anew = replace(self._trial, since=now.wall, so_far=None, differences=())
            self.account = Account(anew)
        self.account.judged(
            rule, self._live(limits, changes), self._live(would, crossed), now
        )

    def _live(
        self, limits: Limits, changes: Iterable[LimitChange]
    ) -> tuple[Limits, Sequence[LimitChange]]:
        """What concerns robots of today."""
        live = {robot.robot_id for robot in self._world.live_robots()}
        of_live = {name: one for name, one in limits.items() if name in live}
        return of_live, [one for one in changes if one.crossing.robot_id in live]

    def _new_id(self) -> str:
        return f"shadow-{next(self._ids)}"


class Trials:
    """Begins, ends and promotes trials by an operator's word.

    Args:
        store: Keeps the trial for the next start of iVeg.
        kept: What the last run left.
    """

    def __init__(
        self,
        shadow: ShadowRule,
        evaluator: Evaluator,
        rules: Rules,
        store: ChoiceStore[Trial | None],
        kept: Trial | None,
        clock: Clock,
    ) -> None:
        self._shadow, self._evaluator, self._rules = shadow, evaluator, rules
        self._store, self._clock = store, clock
        self._one_by_one = asyncio.Lock()
        if kept is not None:
            shadow.begin(kept, evaluator, clock())

    @property
    def current(self) -> Trial | None:
        """The trial as it stands; None: nothing is tried."""
        return self._shadow.trial()

    async def begin(self, wanted: DetectionRule, by: str, at: Instant) -> Trial:
        """Try a candidate.

        Raises:
            TrialRefusedError: another is tried, or it is the version in force.
            HopError: it could not be written down; nothing is tried.
        """
        async with self._one_by_one:
            if self.current is not None:
                raise TrialRefusedError("running")
            if is_same(wanted, self._rules.current):
                raise TrialRefusedError("same")
            trial = Trial(replace(wanted, author=by, since=None), by, at.wall)
            await self._store.save(trial)
            self._shadow.begin(trial, self._evaluator, at)
            return trial

    async def end(self) -> Trial:
        """End the trial; returns it as it stood.

        Raises:
            TrialRefusedError: nothing is tried.
            HopError: it could not be written down; the trial goes on.
        """
        async with self._one_by_one:
            trial = self._running()
            await self._store.save(None)
            self._shadow.end()
            return trial

    async def promote(self, by: str, at: Instant, seen: int) -> DetectionRule:
        """Put the candidate in force, with what came of the trial; that ends.

        Raises:
            TrialRefusedError: nothing is tried.
            OutdatedError: another version is in force than was seen.
            HopError: it could not be written down; the old version stays in force.
        """
        async with self._one_by_one:
            trial = self._running()
            wanted = replace(trial.rule, comparison=trial.so_far)
            rule = await self._rules.change(wanted, by, at, seen)
            self._shadow.end()
            await self._store.save(None)
            return rule

    def _running(self) -> Trial:
        trial = self.current
        if trial is None:
            raise TrialRefusedError("none")
        return trial

    async def run(self) -> None:
        """Write down what came of a trial now and then, until cancelled."""
        while True:
            await asyncio.sleep(SAVED_EVERY_S)
            await self.save()

    async def save(self) -> None:
        """Write down what came of the trial so far.  Raises HopError."""
        async with self._one_by_one:
            if (trial := self.current) is not None:
                await self._store.save(trial)


def is_same(one: DetectionRule, other: DetectionRule) -> bool:
    """Whether two versions judge alike."""
    return _judges(one) == _judges(other)


def _judges(rule: DetectionRule) -> DetectionRule:
    """A version without what judges nothing."""
    return replace(rule, id="", version=0, author="", since=None, comparison=None)
