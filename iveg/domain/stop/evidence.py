"""The robot's newest report, its age, its evidence of motion, and what it allows.

A release, resume or drill that must not happen is refused here, before the machine's
table, and changes nothing.
"""

from collections.abc import Iterable
from math import inf, isfinite, isinf
from typing import Literal

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Hold, Instant, Origin, SafetyReport
from iveg.domain.stop.commands import State
from iveg.domain.stop.standstill import Standstill


class StopEvidence:
    """The newest report of one robot.

    Attributes:
        report: None before the first.
        report_at: When it came; it was at most ``report_age_then`` old then (s).
        speed: Last measured (m/s).
        standstill: Samples at rest and samples that move.
    """

    def __init__(self, robot_id: str) -> None:
        self._robot_id = robot_id
        self.report: SafetyReport | None = None
        self.report_at: Instant | None = None
        self.report_age_then = 0.0
        self.speed = 0.0
        self.standstill = Standstill()

    def note_report(
        self, report: SafetyReport, at: Instant, age_s: float, hold_id: str | None
    ) -> bool:
        """Note a new report, at most ``age_s`` old; returns whether it counts.

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
            self.standstill.forget()
            return "moves"
        # Five samples at rest over a second are a standstill.
        measured = self.standstill.rested(at, report.origin, sparse=sparse)
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
        contradicted = self.standstill.odometry(at, origin, age_s, moves=moves)
        if contradicted is not None:
            self.speed = abs(linear)
        return contradicted is True

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

    def check_drill(self, state: State, at: Instant) -> None:
        """Refuse a drill of a robot that is stopped, moves or says nothing.

        Raises:
            CommandRefusedError: it must not happen now; likewise below.
        """
        if state != "RUNNING":
            raise self._refused("Drill", f"its state is {state}")
        if self.report is None or not self._is_fresh(at):
            raise self._refused("Drill", "its report is not fresh")
        if max(self.speed, abs(self.report.linear)) > LIMITS.drill_speed_m_s:
            raise self._refused("Drill", "it is moving")

    def check_release(
        self, state: State, at: Instant, seen: Iterable[str], joined_at: float
    ) -> tuple[str, tuple[str, ...]]:
        """The challenge that a release must echo, and what it lifts.

        ``joined_at``: when somebody last pressed STOP in this episode (monotonic, s).
        """
        if at.mono - joined_at < LIMITS.joined_unseen_s:
            raise self._refused("Release", "somebody has pressed STOP just now")
        report, challenge = self._check_order("Release", state, "STANDING", at)
        remote = tuple(hold.id for hold in report.holds if hold.ack == "remote")
        if set(seen) not in (set(remote), {hold.id for hold in report.holds}):
            raise self._refused("Release", "the holds changed")
        if not remote:
            raise self._refused("Release", "nothing holds it that iVeg may lift")
        return challenge, remote

    def check_resume(self, state: State, at: Instant) -> str:
        """The challenge that a resume must echo."""
        report, challenge = self._check_order("Resume", state, "READY", at)
        if report.holds:
            raise self._refused("Resume", "it is still held")
        return challenge

    def _check_order(
        self, asked: str, state: State, wanted: State, at: Instant
    ) -> tuple[SafetyReport, str]:
        """The fresh report of a robot that stands, and its challenge."""
        report = self.report
        if state not in (wanted, "RUNNING"):
            raise self._refused(asked, f"its state is {state}")
        if report is None or not self._is_fresh(at):
            raise self._refused(asked, "its report is not fresh")
        if not stands(report):
            raise self._refused(asked, "it is moving")
        if report.challenge is None:
            raise self._refused(asked, "it gave no challenge")
        return report, report.challenge

    def _refused(self, asked: str, why: str) -> CommandRefusedError:
        return CommandRefusedError(self._robot_id, asked, why)

    def _is_fresh(self, at: Instant) -> bool:
        """Whether the robot's newest report is recent, and was not old on arrival."""
        if self.report_age(at) > LIMITS.report_fresh_s:
            return False
        return self.evidence_age(at) <= LIMITS.report_stale_s


def stands(report: SafetyReport) -> bool:
    """Whether a robot reports that it is at rest."""
    return max(abs(report.linear), abs(report.angular)) < LIMITS.standing_speed
