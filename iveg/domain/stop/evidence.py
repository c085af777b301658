"""The robot's newest report, its age, and what it allows people to ask for.

The guards stand before the table of steps: a request that must not happen is refused
here, and changes nothing.
"""

from collections import deque
from collections.abc import Iterable
from math import inf, isfinite

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Hold, Instant, Origin, SafetyReport
from iveg.domain.stop.commands import State

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
        self._answers: deque[tuple[str, int]] = deque(maxlen=_REMEMBERED_ANSWERS)

    def take(self, report: SafetyReport, at: Instant, age_s: float) -> None:
        """A new report, at most ``age_s`` old."""
        self.report, self.report_at, self.report_age_then = report, at, age_s
        self.speed = abs(report.linear)

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

    # --- guards -------------------------------------------------------------------

    def guard_drill(self, robot_id: str, state: State, at: Instant) -> None:
        """Only a robot that hardly moves is stopped to prove that STOP works.

        Raises:
            CommandRefusedError: stopped already, faster than a crawl, or unheard.
        """
        if state != "RUNNING":
            raise CommandRefusedError(robot_id, "Drill", f"its state is {state}")
        if self.report is None or not self._is_fresh(at):
            raise CommandRefusedError(robot_id, "Drill", "its report is not fresh")
        if max(self.speed, abs(self.report.linear)) > LIMITS.drill_speed_m_s:
            raise CommandRefusedError(robot_id, "Drill", "it is moving")

    def guard_release(
        self, robot_id: str, state: State, at: Instant, seen: Iterable[str]
    ) -> tuple[SafetyReport, tuple[str, ...]]:
        """The report that a release rests on, and what it lifts.

        Raises:
            CommandRefusedError: not standing, no fresh report, or the set has changed.
        """
        report = self._guard_order(robot_id, "Release", state, at, "STANDING")
        remote = tuple(hold.id for hold in report.holds if hold.ack == "remote")
        if set(seen) not in (set(remote), {hold.id for hold in report.holds}):
            raise CommandRefusedError(robot_id, "Release", "the holds changed")
        if not remote:
            why = "nothing holds it that iVeg may lift"
            raise CommandRefusedError(robot_id, "Release", why)
        return report, remote

    def guard_resume(self, robot_id: str, state: State, at: Instant) -> SafetyReport:
        """The report that a resume rests on.

        Raises:
            CommandRefusedError: still held, not standing, or no fresh report.
        """
        report = self._guard_order(robot_id, "Resume", state, at, "READY")
        if report.holds:
            raise CommandRefusedError(robot_id, "Resume", "it is still held")
        return report

    def _guard_order(
        self, robot_id: str, asked: str, state: State, at: Instant, wanted: State
    ) -> SafetyReport:
        """The fresh report of a robot that stands."""
        report = self.report
        if state not in (wanted, "RUNNING"):
            raise CommandRefusedError(robot_id, asked, f"its state is {state}")
        if report is None or not self._is_fresh(at):
            raise CommandRefusedError(robot_id, asked, "its report is not fresh")
        if not stands(report):
            raise CommandRefusedError(robot_id, asked, "it is moving")
        if report.challenge is None:
            raise CommandRefusedError(robot_id, asked, "it gave no challenge")
        return report

    def _is_fresh(self, at: Instant) -> bool:
        """Whether the robot's last word has just come, and was not old when it came."""
        if self.report_age(at) > LIMITS.report_fresh_s:
            return False
        return self.evidence_age(at) <= LIMITS.report_stale_s


def stands(report: SafetyReport) -> bool:
    """Whether a robot says that it is at rest."""
    return max(abs(report.linear), abs(report.angular)) < LIMITS.standing_speed
