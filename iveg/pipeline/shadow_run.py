"""One trial of a rule as it runs, with people and crossings of its own."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import count
from typing import Final

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import DetectionFrame, Instant
from iveg.domain.rule.crossings import LimitChange
from iveg.domain.rule.obstacles import Walkers
from iveg.domain.rule.speed_limits import SpeedLimits
from iveg.domain.rule.trial import Account, Limits, Trial
from iveg.domain.tracking.people import People
from iveg.domain.tracking.sight import AllClear
from iveg.domain.world import World

_SETTLES_S: Final = 2.0
"""Until then it may still miss what those in force remember of earlier scans."""


class ShadowRun:
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
        """A picture of some robot."""
        self._people.sight(frame, self._world, self._rule, seen_at, self._new_id())

    def aged(self, walkers: Iterable[Walkers], now: Instant) -> None:
        """A tick: people age, and lasers see who walks."""
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
        """Judge by the candidate, and compare with what the rule in force gave."""
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
