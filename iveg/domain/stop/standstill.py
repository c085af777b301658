"""Measured standstill: shown by safety reports and not contradicted by odometry.

Five samples at rest over at least a second, none more than half a second after the one
before (0.75 s on a topic that has two a second).  Both are measured on the robot's own
monotonic clock where it sends it, so that neither a burst nor a gap on the way makes or
breaks a rest::

    odometry that moves      before the rest began     changes nothing, however late
                             later, once               no standstill for half a second
                             later, three in a row     contradicts the standstill
                             nobody can say when       counts as later
    pose that moves          whatever its twist says   no standstill
    (``domain/motion``)      since the rest began      contradicts the standstill

Two moments can be compared within one boot, if every topic's moments and stamps rise
with its count.  No wall clock ever protects a standstill.

The robot's newest report, its age, its evidence of motion, and what it allows.

A release or resume that must not happen is refused here, before the machine's
table, and changes nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf, isfinite, isinf
from typing import Literal

from iveg.domain.errors import CommandRefusedError
from iveg.domain.limits import LIMITS
from iveg.domain.motion import WINDOW_S, Motion, MotionTrack
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    Hold,
    Instant,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.domain.stop.commands import State


@dataclass(frozen=True, slots=True)
class StandstillMoment:
    """Time of a measurement, on the robot's clock if it is comparable.

    Attributes:
        boot: Of the robot; None where its clock says nothing.
        at: Seconds: since that boot, else of iVeg's monotonic clock at arrival.
    """

    boot: str | None
    at: float

    def since(self, earlier: "StandstillMoment") -> float | None:
        """Seconds from one moment to this; None where they cannot be compared."""
        return self.at - earlier.at if self.boot == earlier.boot else None


@dataclass(slots=True)
class TopicOrder:
    """The count of one topic, and whether its moments and stamps rise with it.

    A stamp that falls makes one message incomparable, since clocks are set; a moment
    that does not rise makes all of that boot so, since what is no clock cannot tell.
    """

    _newest: Origin = field(default=UNKNOWN_ORIGIN)
    _broken: str | None = None

    def moment(self, origin: Origin, arrived: Instant) -> StandstillMoment:
        """Time of measurement of a message of this topic."""
        before, self._newest = self._newest, origin
        unknown = StandstillMoment(None, arrived.mono)
        if origin.boot is None or origin.seq is None or origin.mono is None:
            return unknown
        if before.boot == origin.boot:
            if (before.mono or 0.0) >= origin.mono or (before.seq or 0) >= origin.seq:
                self._broken = origin.boot
            elif _fell(before.stamp_s, origin.stamp_s):
                return unknown
        return (
            unknown
            if self._broken == origin.boot
            else StandstillMoment(origin.boot, origin.mono)
        )


def _fell(before: float | None, after: float | None) -> bool:
    return before is not None and after is not None and after < before


class Standstill:
    """Counts samples at rest and samples that move.

    Attributes:
        since: Arrival of the first sample of the present rest.
    """

    def __init__(self) -> None:
        self.since: Instant | None = None
        self._began: StandstillMoment | None = None
        self._stood: tuple[StandstillMoment, Instant] | None = None
        self._count = 0
        self._newest = StandstillMoment(None, float("-inf"))
        self._moving_samples = 0
        self._moved: StandstillMoment | None = None
        self._moved_at = float("-inf")
        self._place_moved_at = self._jumped_at = float("-inf")
        self._track = MotionTrack()
        """Since the rest began."""
        self._reports, self._odometry = TopicOrder(), TopicOrder()

    def forget(self) -> None:
        """Discard all samples."""
        self._stood = None
        self._begin_anew()

    def _begin_anew(self) -> None:
        self.since, self._began, self._count = None, None, 0
        self._track = MotionTrack()

    def rested(
        self, at: Instant, origin: Origin = UNKNOWN_ORIGIN, *, sparse: bool = False
    ) -> bool:
        """Take one more report at rest; returns whether the rest is a standstill.

        ``sparse``: it came on a topic that has two reports a second, not ten.
        """
        moment = self._reports.moment(origin, at)
        gap = moment.since(self._newest)
        longest = LIMITS.standing_gap_sparse_s if sparse else LIMITS.standing_gap_s
        if gap is None or gap > longest:
            # Nobody knows what it did in the gap.
            self._begin_anew()
        if self.since is None or self._began is None:
            self.since, self._began = at, moment
        self._newest = moment
        self._count += 1
        measured = bool(
            self._count >= LIMITS.standing_samples
            and (moment.since(self._began) or 0.0) >= LIMITS.standing_for_s
            and not self._moved_lately(moment, at)
            and not self.place_moves(at)
            and (self._stood or at.mono - self._jumped_at > WINDOW_S)
        )
        if measured and self._stood is None:
            self._stood = self._began, self.since
        return measured

    def place_moves(self, at: Instant) -> bool:
        """Whether the robot's poses of the last second move."""
        return at.mono - self._place_moved_at <= WINDOW_S

    def _moved_lately(self, moment: StandstillMoment, at: Instant) -> bool:
        """Whether a wheel moved in the last half second."""
        if self._moved is None:
            return False
        ago = moment.since(self._moved)
        # Where the robot's clock does not tell, the arrival must.
        ago = at.mono - self._moved_at if ago is None else ago
        return ago < LIMITS.standing_gap_s

    def odometry(
        self, said: Odometry, motion: Motion, at: Instant, age_s: float = inf
    ) -> bool | None:
        """Take one sample of odometry, proven to be no older than ``age_s``.

        ``motion``: of the robot by all that is known.

        Returns:
            Whether it contradicts the rest; None for one from before the rest, which
            says nothing of it.
        """
        moment, twist = self._odometry.moment(said.origin, at), said.twist
        if self._is_before_the_rest(moment, at.mono - age_s):
            return None
        self._place_moved_at = at.mono if motion.pose_moves else float("-inf")
        if motion.jumped:
            self._jumped_at = at.mono
        moves = max(abs(twist.linear_x), abs(twist.angular_z)) >= LIMITS.standing_speed
        self._moving_samples = self._moving_samples + 1 if moves else 0
        if moves:
            self._moved, self._moved_at = moment, at.mono
        if self._moving_samples >= LIMITS.standing_contradicted_by:
            return True
        if self.since is None:
            return False
        rest = self._track.note_odometry(said.pose, twist, at.mono, said.origin)
        return rest.pose_moves

    def _is_before_the_rest(self, moment: StandstillMoment, not_before: float) -> bool:
        """Whether the robot's own clock says so, and nothing proves it wrong."""
        began, since = self._stood or (self._began, self.since)
        if began is None or since is None or moment.boot is None:
            return False
        after = moment.since(began)
        return after is not None and after <= 0.0 and not_before <= since.mono


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
        self, said: Odometry, motion: Motion, at: Instant, age_s: float
    ) -> bool:
        """Whether odometry contradicts a standstill: motion that was measured later.

        This one is proven to be no older than ``age_s``.
        """
        contradicted = self.standstill.odometry(said, motion, at, age_s)
        if contradicted is not None:
            self.speed = motion.speed if motion.moves else abs(said.twist.linear_x)
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
        if not stands(report) or self.standstill.place_moves(at):
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
