"""A candidate version of the rule that runs beside the one in force: a trial.

It hears the same pictures, walkers and ticks at the same moments, and has people,
rings and crossings of its own over the same world, which it only reads.  It acts on
nothing: no feedback, decision or alert knows of it (``tests/properties/test_shadow``).
What lasers see is taken as it was judged in force, people whom cameras saw left out.
"""

from collections.abc import Callable, Iterable
from typing import Final

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import DetectionFrame, Instant
from iveg.domain.rule.crossings import LimitChange
from iveg.domain.rule.obstacles import Walkers
from iveg.domain.rule.trial import Limits, Trial
from iveg.domain.tracking.laser_sight import LaserSight, ScanOf
from iveg.domain.witness import Plan
from iveg.domain.world import World
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.shadow_run import ShadowRun
from iveg.pipeline.supervision import Supervision

PART: Final = "shadow-rule"


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
        self._running: ShadowRun | None = None

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
        sight = LaserSight(Plan.of(self._greenhouse), self._newest_scan)
        known = evaluator.beginning()
        self._running = ShadowRun(
            self._world, self._greenhouse, trial, *known, sight.all_clear(), now
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

    def _run(self, tell: Callable[[ShadowRun], None]) -> None:
        if self._running is None:
            return
        try:
            tell(self._running)
        except Exception:
            # What it says from here on would be wrong.
            self.end()
            raise
