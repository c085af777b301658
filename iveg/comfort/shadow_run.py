"""One trial of a rule as it runs, with people and entries of its own."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import count
from typing import Final

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import DetectionFrame, Instant, SafetyReport
from iveg.domain.rule.judge import SpeedLimits
from iveg.domain.rule.trial import Account, Limits, Trial
from iveg.domain.rule.zones import LimitChange
from iveg.domain.tracking.people import People
from iveg.domain.tracking.sight import Look, OwnSight
from iveg.domain.world import World

_SETTLES_S: Final = 2.0
"""Until then it may still miss what those in force remember of earlier scans."""


class ShadowRun:
    """One trial, with people and entries of its own."""

    def __init__(
        self,
        world: World,
        greenhouse: Greenhouse,
        trial: Trial,
        people: People,
        limits: SpeedLimits,
        now: Instant,
    ) -> None:
        self.account = Account(trial)
        self._world, self._own_sight = world, OwnSight(greenhouse)
        self._trial, self._rule = trial, trial.rule
        self._people, self._limits = people, limits
        self._counts_from = now.mono + _SETTLES_S
        self._ids = count()

    def looked(self, frame: DetectionFrame, seen_at: Instant, at: Instant) -> None:
        """A picture of some robot, and when it came."""
        known, robot = self._people, self._world.robot(frame.robot_id)
        answered = self._world.word_answers.persons(frame.detector or frame.robot_id)
        rule = self._rule.also_naming(answered)
        placed = known.sight(frame, self._world, rule, seen_at, self._new_id())
        self._own_sight.take(Look.of_frame(robot, frame, placed, at), known)

    def witnessed(self, report: SafetyReport, at: Instant) -> None:
        """What some robot's laser sees walk."""
        self._people.witness(report, at, self._new_id())

    def aged(self, now: Instant) -> None:
        """A tick: people age."""
        self._people.forget(now)

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
        return of_live, [one for one in changes if one.entry.robot_id in live]

    def _new_id(self) -> str:
        return f"shadow-{next(self._ids)}"
