"""A candidate version of the rule that runs beside the one in force: a trial.

It hears the same pictures, reports and ticks at the same moments, and has people,
zones and entries of its own over the same world, which it only reads.  It acts on
nothing: no feedback, decision or alert knows of it (``tests/properties/test_shadow``).
"""

from collections.abc import Callable, Iterable
from typing import Final

from iveg.comfort.shadow_run import ShadowRun
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import DetectionFrame, Instant, SafetyReport
from iveg.domain.rule.trial import Limits, Trial
from iveg.domain.rule.zones import LimitChange
from iveg.domain.world import World
from iveg.vital.evaluate import Evaluator
from iveg.vital.supervision import Supervision

PART: Final = "shadow-rule"


class ShadowRule:
    """Judges by a candidate, and does nothing where there is none.

    Args:
        world: Read, never written.
    """

    def __init__(self, world: World, greenhouse: Greenhouse) -> None:
        self._world, self._greenhouse = world, greenhouse
        self._running: ShadowRun | None = None

    @classmethod
    def beside(cls, evaluator: Evaluator, supervision: Supervision) -> "ShadowRule":
        """One that an evaluator tells what it does; what fails here is its own."""
        shadow = cls(evaluator.world, evaluator.greenhouse)
        evaluator.tracking.taken = supervision.guard(PART, shadow.looked)
        evaluator.tracking.witnessed = supervision.guard(PART, shadow.witnessed)
        evaluator.aged = supervision.guard(PART, shadow.aged)
        evaluator.judged = supervision.guard(PART, shadow.judged)
        return shadow

    def begin(self, trial: Trial, evaluator: Evaluator, now: Instant) -> None:
        """Begin with what those in force know by now."""
        known = evaluator.beginning()
        self._running = ShadowRun(self._world, self._greenhouse, trial, *known, now)

    def end(self) -> None:
        """Forget it."""
        self._running = None

    def trial(self) -> Trial | None:
        """The trial as it stands; None: nothing is tried."""
        return None if self._running is None else self._running.account.trial()

    # --- what the evaluator tells -------------------------------------------------

    def looked(self, frame: DetectionFrame, seen_at: Instant, at: Instant) -> None:
        """A picture was taken in."""
        self._run(lambda one: one.looked(frame, seen_at, at))

    def witnessed(self, report: SafetyReport, at: Instant) -> None:
        """A robot reported what its laser sees."""
        self._run(lambda one: one.witnessed(report, at))

    def aged(self, now: Instant) -> None:
        """Time has passed."""
        self._run(lambda one: one.aged(now))

    def judged(
        self,
        rule: DetectionRule,
        limits: Limits,
        changes: Iterable[LimitChange],
        now: Instant,
    ) -> None:
        """The fleet was judged by the version in force."""
        self._run(lambda one: one.judged(rule, limits, changes, now))

    def _run(self, tell: Callable[[ShadowRun], None]) -> None:
        if self._running is None:
            return
        try:
            tell(self._running)
        except Exception:
            # What it says from here on would be wrong.
            self.end()
            raise
