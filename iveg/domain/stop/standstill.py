"""Standing still, as it is measured; and what a robot's newest report allows.

A robot *stands* when all of these hold (docs/safety.md, "STOP", I3):

1. Its safety report says rest: below 0.02 m/s and 0.02 rad/s (``says_rest``).
2. The rest has no gap: no report comes more than 0.5 s after the one before (0.75 s on
   a topic that has two a second).
3. The rest is long: five reports or more, over a second or more.
4. No wheel moved in the last half second, by odometry.
5. The place stays, by the poses of odometry: no motion in the last second, whatever the
   twist says, and no jump either when the standstill begins (``domain/motion``).
6. The newest report is at most 1.5 s old, its way included.

Steps 2 to 4 are measured on the robot's own monotonic clock where it sends it, so that
neither a burst nor a gap on the way makes or breaks a rest.  A standstill ends by
*later* motion alone::

    odometry that moves      before the rest began     changes nothing, however late
                             later, once               no standstill for half a second
                             later, three in a row     contradicts the standstill
                             incomparable              counts as later
    pose that moves          since the rest began      contradicts the standstill

Two moments can be compared within one boot, if every topic's moments and stamps rise
with its count.  No wall clock ever protects a standstill.

A release or resume that must not happen (I2) is refused here, before the machine's
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


def says_rest(report: SafetyReport) -> bool:
    """Whether a robot reports that it is at rest."""
    return max(abs(report.linear), abs(report.angular)) < LIMITS.standing_speed


@dataclass(frozen=True, slots=True)
class Moment:
    """Time of a measurement, on the robot's clock if it is comparable.

    Attributes:
        boot: Of the robot; None where its clock says nothing.
        at: Seconds: since that boot, else of iVeg's monotonic clock at arrival.
    """

    boot: str | None
    at: float

    def since(self, earlier: "Moment") -> float | None:
        """Seconds from one moment to this; None where they cannot be compared."""
        return self.at - earlier.at if self.boot == earlier.boot else None


class TopicOrder:
    """The count of one topic, and whether its moments and stamps rise with it.

    A stamp that falls makes one message incomparable, since clocks are set; a moment
    that does not rise makes all of that boot so, since what is no clock cannot tell.
    """

    def __init__(self) -> None:
        self._newest = UNKNOWN_ORIGIN
        self._broken: str | None = None

    def moment(self, origin: Origin, arrived: Instant) -> Moment:
        """Time of measurement of a message of this topic."""
        before, self._newest = self._newest, origin
        unknown = Moment(None, arrived.mono)
        if origin.boot is None or origin.seq is None or origin.mono is None:
            return unknown
        if before.boot == origin.boot:
            if (before.mono or 0.0) >= origin.mono or (before.seq or 0) >= origin.seq:
                self._broken = origin.boot
            elif _fell(before.stamp_s, origin.stamp_s):
                return unknown
        is_broken = self._broken == origin.boot
        return unknown if is_broken else Moment(origin.boot, origin.mono)


def _fell(before: float | None, after: float | None) -> bool:
    return before is not None and after is not None and after < before


@dataclass(slots=True)
class _Rest:
    """Reports at rest without a gap between them.

    Attributes:
        since: Arrival of the first.
        began: Its moment; ``newest`` that of the last.
        reports: Number of them.
        track: Poses since it began.
    """

    since: Instant
    began: Moment
    newest: Moment
    reports: int = 0
    track: MotionTrack = field(default_factory=MotionTrack)

    @property
    def is_long(self) -> bool:
        """Step 3."""
        lasted = self.newest.since(self.began) or 0.0
        enough = self.reports >= LIMITS.standing_samples
        return enough and lasted >= LIMITS.standing_for_s


class Standstill:
    """Steps 2 to 5: reports at rest, and odometry that contradicts them."""

    def __init__(self) -> None:
        self._rest: _Rest | None = None
        self._stood: tuple[Moment, Instant] | None = None
        """The beginning of the rest that first was a standstill."""
        self._moving_samples = 0
        self._moved: tuple[Moment, float] | None = None
        """The newest sample of odometry whose wheels moved, and its arrival (s)."""
        self._place_moved_at = self._displaced_at = -inf
        self._reports, self._odometry = TopicOrder(), TopicOrder()

    @property
    def since(self) -> Instant | None:
        """Arrival of the first report of the present rest."""
        return None if self._rest is None else self._rest.since

    def forget(self) -> None:
        """Discard all reports: a rest begins anew."""
        self._rest = self._stood = None

    def rested(
        self, at: Instant, origin: Origin = UNKNOWN_ORIGIN, *, sparse: bool = False
    ) -> bool:
        """Take one more report at rest; returns whether the rest is a standstill.

        ``sparse``: it came on a topic that has two reports a second, not ten.
        """
        moment, rest = self._reports.moment(origin, at), self._rest
        gap = None if rest is None else moment.since(rest.newest)
        longest = LIMITS.standing_gap_sparse_s if sparse else LIMITS.standing_gap_s
        if rest is None or gap is None or gap > longest:
            # Step 2: nobody knows what it did in the gap.
            rest = self._rest = _Rest(at, moment, moment)
        rest.newest = moment
        rest.reports += 1
        is_standstill = (
            rest.is_long
            and not self._wheels_moved(moment, at)
            and not self.place_moves(at)
            and (self._stood is not None or at.mono - self._displaced_at > WINDOW_S)
        )
        if is_standstill and self._stood is None:
            self._stood = rest.began, rest.since
        return is_standstill

    def _wheels_moved(self, moment: Moment, at: Instant) -> bool:
        """Step 4 fails: a wheel moved in the last half second."""
        if self._moved is None:
            return False
        moved, arrived = self._moved
        ago = moment.since(moved)
        # Where the robot's clock does not tell, the arrival must.
        ago = at.mono - arrived if ago is None else ago
        return ago < LIMITS.standing_gap_s

    def place_moves(self, at: Instant) -> bool:
        """Step 5 fails: the robot's poses of the last second move."""
        return at.mono - self._place_moved_at <= WINDOW_S

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
        self._place_moved_at = at.mono if motion.pose_moves else -inf
        self._displaced_at = at.mono if motion.displaced else -inf
        self._moving_samples += 1
        if max(abs(twist.linear_x), abs(twist.angular_z)) < LIMITS.standing_speed:
            self._moving_samples = 0
        else:
            self._moved = moment, at.mono
        if self._moving_samples >= LIMITS.standing_contradicted_by:
            return True
        if self._rest is None:
            return False
        rest = self._rest.track.note_odometry(said.pose, twist, at.mono, said.origin)
        return rest.pose_moves

    def _is_before_the_rest(self, moment: Moment, not_before: float) -> bool:
        """Whether the robot's own clock says so, and nothing proves it wrong."""
        rest = self._rest
        if self._stood is not None:
            began, since = self._stood
        elif rest is not None:
            began, since = rest.began, rest.since
        else:
            return False
        after = moment.since(began)
        if moment.boot is None or after is None:
            return False
        return after <= 0.0 and not_before <= since.mono


class StopEvidence:
    """The newest report of one robot, its age, and what it allows.

    Attributes:
        report: None before the first.
        speed: Last measured (m/s).
        standstill: Reports at rest, and odometry that contradicts them.
    """

    def __init__(self, robot_id: str) -> None:
        self._robot_id = robot_id
        self.report: SafetyReport | None = None
        self._came_at, self._age_then_s = -inf, 0.0
        """When it came (monotonic, s), and its greatest age by then (s)."""
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
        self.report, self._came_at, self._age_then_s = report, at.mono, age_s
        self.speed = abs(report.linear)
        return True

    def motion(
        self, report: SafetyReport, at: Instant, *, sparse: bool
    ) -> Literal["moves", "stands"] | None:
        """Motion by the newest report; None while it is uncertain."""
        if not says_rest(report):
            self.standstill.forget()
            return "moves"
        measured = self.standstill.rested(at, report.origin, sparse=sparse)
        if self.evidence_age(at) > LIMITS.report_stale_s:
            return None  # it stood; nobody knows whether it stands
        return "stands" if measured else None

    def is_contradicted(
        self, said: Odometry, motion: Motion, at: Instant, age_s: float
    ) -> bool:
        """Whether odometry, at most ``age_s`` old, contradicts a standstill."""
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
        """Reported holds that are STOPs of iVeg, newest last."""
        return [hold.id for hold in self.holds if hold.source == "iveg"]

    def report_age(self, now: Instant) -> float:
        """Time since the newest report came (s); infinite before the first."""
        return now.mono - self._came_at

    def evidence_age(self, now: Instant) -> float:
        """Greatest age of the newest report, its way included (s)."""
        return self.report_age(now) + self._age_then_s

    def moved_m(self, now: Instant) -> float:
        """Distance that the robot may have driven since its newest report (m)."""
        if self.report is None:
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
        self, order: str, state: State, wanted: State, at: Instant
    ) -> tuple[SafetyReport, str]:
        """The fresh report of a robot that stands, and its challenge."""
        report = self.report
        if state not in (wanted, "RUNNING"):
            raise self._refused(order, f"its state is {state}")
        if report is None or not self._is_fresh(at):
            raise self._refused(order, "its report is not fresh")
        if not says_rest(report) or self.standstill.place_moves(at):
            raise self._refused(order, "it is moving")
        if report.challenge is None:
            raise self._refused(order, "it gave no challenge")
        return report, report.challenge

    def _refused(self, order: str, why: str) -> CommandRefusedError:
        return CommandRefusedError(self._robot_id, order, why)

    def _is_fresh(self, at: Instant) -> bool:
        """Whether the robot's newest report is recent, and was not old on arrival."""
        is_recent = self.report_age(at) <= LIMITS.report_fresh_s
        return is_recent and self.evidence_age(at) <= LIMITS.report_stale_s
