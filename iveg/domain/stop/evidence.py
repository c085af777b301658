"""The robot's newest report, its age, and its evidence of motion."""

from collections import deque
from math import inf, isfinite, isinf
from typing import Literal

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Hold, Instant, Origin, SafetyReport
from iveg.domain.stop.standstill import Standstill

_REMEMBERED_ANSWERS = 64


class Evidence:
    """The newest report of one robot.

    Attributes:
        report: None before the first.
        report_at: When it came; it was at most ``report_age_then`` old then (s).
        speed: Last measured (m/s).
    """

    def __init__(self) -> None:
        self.report: SafetyReport | None = None
        self.report_at: Instant | None = None
        self.report_age_then = 0.0
        self.speed = 0.0
        self._standstill = Standstill()
        self._answers: deque[tuple[str, int]] = deque(maxlen=_REMEMBERED_ANSWERS)

    def take(
        self, report: SafetyReport, at: Instant, age_s: float, hold_id: str | None
    ) -> bool:
        """A new report, at most ``age_s`` old; whether it counts.

        One of no known age does only where it holds ``hold_id``, the hold that iVeg
        asked for: nothing from before that STOP can name it.
        """
        if isinf(age_s) and hold_id not in {hold.id for hold in report.holds}:
            return False
        self.report, self.report_at, self.report_age_then = report, at, age_s
        self.speed = abs(report.linear)
        return True

    def motion(
        self, report: SafetyReport, at: Instant, *, sparse: bool
    ) -> Literal["moves", "stands"] | None:
        """Motion by the newest report; None while it is uncertain."""
        if not stands(report):
            self._standstill.forget()
            return "moves"
        # Five samples at rest over a second are a standstill.
        measured = self._standstill.rested(at, report.origin, sparse=sparse)
        if self.evidence_age(at) > LIMITS.report_stale_s:
            return None  # it stood; nobody knows whether it stands
        return "stands" if measured else None

    def is_contradicted(
        self, linear: float, angular: float, at: Instant, origin: Origin, age_s: float
    ) -> bool:
        """Whether odometry contradicts a standstill: three that move, measured later.

        This one is proven to be no older than ``age_s``.
        """
        moves = max(abs(linear), abs(angular)) >= LIMITS.standing_speed
        contradicted = self._standstill.odometry(at, origin, age_s, moves=moves)
        if contradicted is not None:
            self.speed = abs(linear)
        return contradicted is True

    def is_news(self, answer: Origin) -> bool:
        """Whether this answer is new; an answer without origin always is."""
        if answer.boot is None or answer.seq is None:
            return True
        # The agent's copy has lost its stamp.
        identity = answer.boot, answer.seq
        if identity in self._answers:
            return False
        self._answers.append(identity)
        return True

    @property
    def holds(self) -> tuple[Hold, ...]:
        """The holds that the robot last reported."""
        return () if self.report is None else self.report.holds

    @property
    def ours(self) -> list[str]:
        """Those of them that are STOPs of iVeg, newest last."""
        return [hold.id for hold in self.holds if hold.source == "iveg"]

    def report_age(self, now: Instant) -> float:
        """Time since the newest report (s); infinite before the first."""
        return inf if self.report_at is None else now.mono - self.report_at.mono

    def evidence_age(self, now: Instant) -> float:
        """Greatest age of the newest report, its way included (s)."""
        return self.report_age(now) + self.report_age_then

    def moved_m(self, now: Instant) -> float:
        """How far the robot may have driven since its newest report (m)."""
        if self.report_at is None:
            return 0.0
        age = self.evidence_age(now)
        return self.speed * max(0.0, age if isfinite(age) else self.report_age(now))


def stands(report: SafetyReport) -> bool:
    """Whether a robot reports that it is at rest."""
    return max(abs(report.linear), abs(report.angular)) < LIMITS.standing_speed
