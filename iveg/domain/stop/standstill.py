"""Measurement of a standstill, and the orders that a robot's newest report allows.

A robot *stands* when all of these hold (docs/safety.md, "STOP", I3):

1. Its safety report says rest: below 0.02 m/s and 0.02 rad/s (``says_rest``).
2. The rest is unbroken: reports come at most 0.5 s apart (0.75 s on a topic that has
   two a second).
3. The rest is long: five reports or more, over a second or more.
4. No wheel moved in the last half second, by odometry.
5. The pose stays, by odometry: no motion in the last second, whatever the twist says,
   and no jump either when the standstill begins (``domain/motion``).
6. The newest report is at most 1.5 s old, its transit included.

Steps 2 to 4 are measured on the robot's own monotonic clock where it sends it, so a gap
in transit breaks no rest.  That clock may be wrong, so ours must agree:

- Step 2: no echo proves a longer gap between a report and the arrival before it.
- Step 3: arrivals span the second, too.  The proven age of the first report, 0.5 s of
  it at most, is added, as it may be delay.  So jitter delays no standstill, and a burst
  after a gap in transit makes none.  A clock that is too fast gains at most that age
  and the transit of the newest report.
- Step 4: half a second has passed since the arrival of the motion, too.

A standstill ends by *later* motion alone::

    odometry that moves      before the rest began     changes nothing, however late
                             later, once               no standstill for half a second
                             later, three in a row     contradicts the standstill
                             incomparable              counts as later
    pose that moves          since the rest began      contradicts the standstill

Two moments can be compared within one boot, if the moments and stamps of each topic
rise with its count.  No wall clock ever protects a standstill.

A release or resume that must not happen (I2) is refused here, before the table of the
machine, and changes nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
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
    """Time of a measurement, on the robot's clock if that is comparable.

    Attributes:
        boot: Boot of the robot; None: its clock is not comparable.
        at: Time since that boot (s); without a boot, ``arrived``.
        arrived: Arrival on iVeg's monotonic clock (s).
        not_before: Lower bound of the moment on that clock, as proven (s).
    """

    boot: str | None
    at: float
    arrived: float
    not_before: float

    def since(self, earlier: "Moment") -> float:
        """Time since an earlier moment (s); infinite: not comparable."""
        return self.at - earlier.at if self.boot == earlier.boot else inf

    @property
    def late_s(self) -> float:
        """Delay in transit that a proven age explains (s)."""
        late_s = self.arrived - self.not_before
        return 0.0 if isinf(late_s) else min(late_s, LIMITS.standing_gap_s)


class TopicOrder:
    """The count of one topic, and whether its moments and stamps rise with it.

    A stamp that falls makes one message incomparable, since clocks are set.  A moment
    that does not rise makes the whole boot incomparable, since it comes from no clock.
    """

    def __init__(self) -> None:
        self._newest = UNKNOWN_ORIGIN
        self._broken: str | None = None

    def moment(self, origin: Origin, at: Instant, age_s: float) -> Moment:
        """Time at which the next message, at most ``age_s`` old, was measured."""
        before, self._newest = self._newest, origin
        before_s, stamp_s = before.stamp_s, origin.stamp_s
        unknown = Moment(None, at.mono, at.mono, at.mono - age_s)
        if origin.boot is None or origin.seq is None or origin.mono is None:
            return unknown
        if before.boot == origin.boot:
            if (before.mono or 0.0) >= origin.mono or (before.seq or 0) >= origin.seq:
                self._broken = origin.boot
            elif before_s is not None and stamp_s is not None and stamp_s < before_s:
                return unknown
        if self._broken == origin.boot:
            return unknown
        return replace(unknown, boot=origin.boot, at=origin.mono)


@dataclass(slots=True)
class _Rest:
    """Unbroken series of reports at rest.

    Attributes:
        since: Arrival of the first.
        began: Moment of the first; ``newest``: of the last.
        reports: Number of reports.
        track: Motion by the odometry since it began.
    """

    since: Instant
    began: Moment
    newest: Moment
    reports: int = 0
    track: MotionTrack = field(default_factory=MotionTrack)

    @property
    def is_long(self) -> bool:
        """Whether there are enough reports, over a time that is long enough (3)."""
        began, newest = self.began, self.newest
        arrived_s = newest.arrived - began.arrived + began.late_s
        lasted = min(newest.since(began), arrived_s)
        enough = self.reports >= LIMITS.standing_samples
        return enough and lasted >= LIMITS.standing_for_s


class Standstill:
    """Measurement of one robot's rest: steps 2 to 5."""

    def __init__(self) -> None:
        self._rest: _Rest | None = None
        self._stood: Moment | None = None
        """Begin of the rest, once it was a standstill."""
        self._moving_samples = 0
        """Moving samples of odometry in a row."""
        self._wheels_moved_at = Moment(None, -inf, -inf, -inf)
        """Newest moving sample of odometry."""
        self._pose_moved_at = self._displaced_at = -inf
        """Arrival of the newest moving, and of the newest displaced pose."""
        self._reports, self._odometry = TopicOrder(), TopicOrder()

    @property
    def since(self) -> Instant | None:
        """Arrival of the first report of the present rest; None: it does not rest."""
        return None if self._rest is None else self._rest.since

    def forget(self) -> None:
        """Discard all reports, so that a rest begins anew."""
        self._rest = self._stood = None

    def rested(
        self,
        at: Instant,
        origin: Origin = UNKNOWN_ORIGIN,
        age_s: float = inf,
        *,
        sparse: bool = False,
    ) -> bool:
        """Take one more report at rest; returns whether the rest is a standstill.

        Args:
            at: When it came.
            origin: Its count and clock.
            age_s: Its greatest age when it came (s).
            sparse: Whether its topic has two reports a second, not ten.
        """
        moment, rest = self._reports.moment(origin, at, age_s), self._rest
        longest = LIMITS.standing_gap_sparse_s if sparse else LIMITS.standing_gap_s
        if (
            rest is None
            # Step 2: between these reports it may have moved.
            or moment.since(rest.newest) > longest
            or moment.not_before - rest.newest.arrived > longest
        ):
            rest = self._rest = _Rest(at, moment, moment)
        rest.newest = moment
        rest.reports += 1
        is_standstill = (
            rest.is_long
            and not self._wheels_moved(moment)
            and not self.pose_moves(at)
            # A jump only delays the begin: it may be noise of a localisation.
            and (self._stood is not None or at.mono - self._displaced_at > WINDOW_S)
        )
        if is_standstill and self._stood is None:
            self._stood = rest.began
        return is_standstill

    def _wheels_moved(self, moment: Moment) -> bool:
        """Whether a wheel moved in the last half second, so that step 4 fails."""
        moved = self._wheels_moved_at
        ago_s = min(moment.since(moved), moment.arrived - moved.arrived)
        return ago_s < LIMITS.standing_gap_s

    def pose_moves(self, at: Instant) -> bool:
        """Whether the pose moved in the last second, so that step 5 fails."""
        return at.mono - self._pose_moved_at <= WINDOW_S

    def odometry(
        self, odometry: Odometry, motion: Motion, at: Instant, age_s: float = inf
    ) -> Literal["before", "agrees", "contradicts"]:
        """Take one sample of odometry, proven to be at most ``age_s`` old.

        ``motion``: Motion of the robot by all its sources.

        Returns:
            Whether it contradicts the rest; ``before``: it is from before the rest and
            proves nothing.
        """
        moment, twist = (
            self._odometry.moment(odometry.origin, at, age_s),
            odometry.twist,
        )
        if self._is_before_the_rest(moment):
            return "before"
        self._pose_moved_at = at.mono if motion.pose_moves else -inf
        self._displaced_at = at.mono if motion.displaced else -inf
        self._moving_samples += 1
        if max(abs(twist.linear_x), abs(twist.angular_z)) < LIMITS.standing_speed:
            self._moving_samples = 0
        else:
            self._wheels_moved_at = moment
        moves = self._moving_samples >= LIMITS.standing_contradicted_by or (
            # A track that begins with the rest shows no motion from before it.
            self._rest is not None
            and self._rest.track.note_odometry(
                odometry.pose, twist, at.mono, odometry.origin
            ).pose_moves
        )
        return "contradicts" if moves else "agrees"

    def _is_before_the_rest(self, moment: Moment) -> bool:
        """Whether a sample is from before the rest, by the robot's clock and echo."""
        began = self._stood
        if began is None and self._rest is not None:
            began = self._rest.began
        if began is None or moment.boot is None:
            return False
        return moment.since(began) <= 0.0 and moment.not_before <= began.arrived


class StopEvidence:
    """The newest report of one robot, its age, and the orders that it allows.

    Attributes:
        report: The report; None before the first.
        speed: Newest measured speed (m/s).
        standstill: Measurement of the robot's rest.
    """

    def __init__(self, robot_id: str) -> None:
        self._robot_id = robot_id
        self.report: SafetyReport | None = None
        self._received_at, self._age_then_s = -inf, 0.0
        """Arrival of the report (monotonic, s), and its greatest age then (s)."""
        self.speed = 0.0
        self.standstill = Standstill()

    def note_report(
        self, report: SafetyReport, at: Instant, age_s: float, hold_id: str | None
    ) -> bool:
        """Note a new report, at most ``age_s`` old; returns whether it counts.

        A report of unknown age counts only if it names ``hold_id``, the hold of the
        present STOP: no report from before that STOP can name it.
        """
        if isinf(age_s) and hold_id not in {hold.id for hold in report.holds}:
            return False
        self.report, self._received_at, self._age_then_s = report, at.mono, age_s
        self.speed = abs(report.linear)
        return True

    def motion(
        self, report: SafetyReport, at: Instant, *, sparse: bool
    ) -> Literal["moves", "stands"] | None:
        """Motion by the newest report; None: uncertain."""
        if not says_rest(report):
            self.standstill.forget()
            return "moves"
        measured = self.standstill.rested(
            at, report.origin, self._age_then_s, sparse=sparse
        )
        if self.evidence_age(at) > LIMITS.report_stale_s:
            return None  # The report shows a standstill that may have ended.
        return "stands" if measured else None

    def is_contradicted(
        self, odometry: Odometry, motion: Motion, at: Instant, age_s: float
    ) -> bool:
        """Whether odometry, at most ``age_s`` old, contradicts a standstill."""
        finding = self.standstill.odometry(odometry, motion, at, age_s)
        if finding != "before":
            self.speed = motion.speed if motion.moves else abs(odometry.twist.linear_x)
        return finding == "contradicts"

    @property
    def holds(self) -> tuple[Hold, ...]:
        """Holds in the newest report."""
        return () if self.report is None else self.report.holds

    @property
    def ours(self) -> list[str]:
        """Reported holds that are STOPs of iVeg, newest last."""
        return [hold.id for hold in self.holds if hold.source == "iveg"]

    def report_age(self, now: Instant) -> float:
        """Time since the newest report came (s); infinite before the first."""
        return now.mono - self._received_at

    def evidence_age(self, now: Instant) -> float:
        """Greatest age of the newest report, its transit included (s)."""
        return self.report_age(now) + self._age_then_s

    def moved_m(self, now: Instant) -> float:
        """Distance at the last speed since the newest report (m)."""
        if self.report is None:
            return 0.0
        # A report of unknown age is at least as old as the time since its arrival.
        age = self.evidence_age(now)
        return self.speed * max(0.0, age if isfinite(age) else self.report_age(now))

    # --- guards -------------------------------------------------------------------

    def check_release(
        self, state: State, at: Instant, seen: Iterable[str], joined_at: float
    ) -> tuple[str, tuple[str, ...]]:
        """The challenge that a release must echo, and the holds that it lifts.

        Args:
            state: State of the machine.
            at: This moment.
            seen: Holds that the person saw.
            joined_at: Last press of STOP in this episode (monotonic, s).

        Raises:
            CommandRefusedError: the release must not happen (I2).
        """
        # The person who releases cannot have seen so new a press.
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
        """The challenge that a resume must echo; raises like ``check_release``."""
        report, challenge = self._check_order("Resume", state, "READY", at)
        if report.holds:
            raise self._refused("Resume", "it is still held")
        return challenge

    def _check_order(
        self, order: str, state: State, wanted: State, at: Instant
    ) -> tuple[SafetyReport, str]:
        """The fresh report of a robot that stands, and its challenge."""
        report = self.report
        # RUNNING: iVeg has not stopped it, but it may be held, as after its boot.
        if state not in (wanted, "RUNNING"):
            raise self._refused(order, f"its state is {state}")
        if report is None or not self._is_fresh(at):
            raise self._refused(order, "its report is not fresh")
        if not says_rest(report) or self.standstill.pose_moves(at):
            raise self._refused(order, "it is moving")
        if report.challenge is None:
            raise self._refused(order, "it gave no challenge")
        return report, report.challenge

    def _refused(self, order: str, why: str) -> CommandRefusedError:
        return CommandRefusedError(self._robot_id, order, why)

    def _is_fresh(self, at: Instant) -> bool:
        """Whether the newest report came just now, and was not old on arrival."""
        is_recent = self.report_age(at) <= LIMITS.report_fresh_s
        return is_recent and self.evidence_age(at) <= LIMITS.report_stale_s
