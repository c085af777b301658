"""Trials of a rule: a candidate runs beside the version in force and acts on nothing.

It takes the same frames, reports and ticks at the same moments, and has people, zones
and entries of its own.  No feedback, decision or alert knows of it
(``tests/properties/test_shadow``).  It ends when iVeg does.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import count
from typing import Final

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.detector import judge_frame
from iveg.domain.errors import TrialRefusedError
from iveg.domain.observations import DetectionFrame, Instant, SafetyReport
from iveg.domain.rule.trial import Account, Limits, Trial
from iveg.domain.rule.zones import LimitChange
from iveg.domain.tracking.sight import Look, OwnSight
from iveg.vital.core import Core
from iveg.vital.evaluate import Evaluator
from iveg.vital.operators import Rules

PART: Final = "shadow-rule"
_SETTLES_S: Final = 2.0
"""Time in which a new trial may lack looks of the rule in force (s)."""


class TrialRun:
    """A trial with its own people and zone entries, over the world, which it reads."""

    def __init__(self, trial: Trial, evaluator: Evaluator, now: Instant) -> None:
        self.account = Account(trial)
        self._world, self._own_sight = evaluator.world, OwnSight(evaluator.greenhouse)
        self._trial, self._rule = trial, trial.rule
        # It begins with the present people and limits, not with an empty map.
        self._people, self._limits = evaluator.beginning()
        self._counts_from = now.mono + _SETTLES_S
        self._ids = count()

    def take_frame(self, frame: DetectionFrame, seen_at: Instant, at: Instant) -> None:
        """Take a detection frame that was seen at a moment and received at ``at``."""
        known, robot = self._people, self._world.robot(frame.robot_id)
        listed, answers = robot.description.classes, self._world.word_answers
        judged = judge_frame(frame, self._rule, listed, answers)
        placed = known.sight(judged, robot, self._world, seen_at, self._new_id())
        self._own_sight.take(Look.from_frame(robot, judged.frame, placed, at), known)

    def take_obstacle(self, report: SafetyReport, at: Instant) -> None:
        """Take an obstacle of a robot's laser."""
        self._people.track_obstacle(report, at, self._new_id())

    def aged(self, now: Instant) -> None:
        """Let people age."""
        self._people.forget(now)

    def judged(
        self,
        rule: DetectionRule,
        limits: Limits,
        changes: Iterable[LimitChange],
        now: Instant,
    ) -> None:
        """Judge by the candidate, and compare with the result of the rule in force."""
        own_limits, own_changes = self._limits.evaluate(
            self._world, self._people, self._rule, now, self._new_id()
        )
        if now.mono < self._counts_from:
            return
        if not self.account.compares_with(rule):
            # Sums against the version before would mix two comparisons.
            anew = replace(self._trial, since=now.wall, so_far=None, differences=())
            self.account = Account(anew)
        self.account.judged(
            rule, self._live(limits, changes), self._live(own_limits, own_changes), now
        )

    def _live(
        self, limits: Limits, changes: Iterable[LimitChange]
    ) -> tuple[Limits, Sequence[LimitChange]]:
        """Limits and changes of live robots."""
        live = {robot.robot_id for robot in self._world.live_robots()}
        live_limits = {name: limit for name, limit in limits.items() if name in live}
        return live_limits, [
            change for change in changes if change.entry.robot_id in live
        ]

    def _new_id(self) -> str:
        return f"shadow-{next(self._ids)}"


class Trials:
    """Begins, ends and promotes trials on an operator's order.

    Args:
        core: Its supervision passes events to a trial when they happen.
    """

    def __init__(self, core: Core, evaluator: Evaluator, rules: Rules) -> None:
        self._evaluator, self._rules = evaluator, rules
        self._running: TrialRun | None = None
        core.supervision.listen(
            PART,
            frame_taken=partial(self._follow, TrialRun.take_frame),
            obstacle_reported=partial(self._follow, TrialRun.take_obstacle),
            aged=partial(self._follow, TrialRun.aged),
            judged=partial(self._follow, TrialRun.judged),
        )

    @property
    def current(self) -> Trial | None:
        """The trial with its account so far; None: there is no trial."""
        return None if self._running is None else self._running.account.trial()

    def start(self, trial: Trial, now: Instant) -> None:
        """Run a trial from now on."""
        self._running = TrialRun(trial, self._evaluator, now)

    def _follow(self, take: Callable[..., None], *facts: object) -> None:
        """Have the trial take an event; a failure ends the trial."""
        if self._running is None:
            return
        try:
            take(self._running, *facts)
        except Exception:
            # It has missed an event, so its further account would be wrong.
            self._running = None
            raise

    def begin(self, wanted: DetectionRule, by: str, at: Instant) -> Trial:
        """Try a candidate.

        Raises:
            TrialRefusedError: another is tried, or it is the version in force.
        """
        if self._running is not None:
            raise TrialRefusedError("running")
        if is_same(wanted, self._rules.current):
            raise TrialRefusedError("same")
        trial = Trial(replace(wanted, author=by, since=None), by, at.wall)
        self.start(trial, at)
        return trial

    def end(self) -> Trial:
        """End the trial; returns it as it stood.

        Raises:
            TrialRefusedError: nothing is tried.
        """
        trial = self._tried()
        self._running = None
        return trial

    async def promote(self, by: str, at: Instant, seen: int) -> DetectionRule:
        """Put the candidate in force, with the result of its trial, which ends.

        Raises:
            TrialRefusedError: nothing is tried.
            OutdatedError: another version than the seen one is in force.
            HopError: it could not be written down; the old version stays in force.
        """
        trial, running = self._tried(), self._running
        wanted = replace(trial.rule, comparison=trial.so_far)
        rule = await self._rules.change(wanted, by, at, seen)
        if self._running is running:
            self._running = None
        return rule

    def _tried(self) -> Trial:
        trial = self.current
        if trial is None:
            raise TrialRefusedError("none")
        return trial


def is_same(first: DetectionRule, second: DetectionRule) -> bool:
    """Whether two versions judge alike."""
    return _judges(first) == _judges(second)


def _judges(rule: DetectionRule) -> DetectionRule:
    """A version without the fields that judge nothing."""
    return replace(rule, id="", version=0, author="", since=None, comparison=None)
