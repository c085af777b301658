"""Measured standstill: shown by safety reports and not contradicted by odometry.

Five samples at rest over at least a second, none more than half a second after the one
before (0.75 s on a topic that has two a second).  Both are measured on the robot's own
monotonic clock where it sends it, so that neither a burst nor a gap on the way makes or
breaks a rest::

    odometry that moves      before the rest began     changes nothing, however late
                             later, once               no standstill for half a second
                             later, three in a row     contradicts the standstill
                             nobody can say when       counts as later

Two moments can be compared within one boot, if every topic's moments and stamps rise
with its count.  No wall clock ever protects a standstill.
"""

from dataclasses import dataclass, field
from math import inf

from iveg.domain.limits import LIMITS
from iveg.domain.observations import UNKNOWN_ORIGIN, Instant, Origin


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
        self._reports, self._odometry = TopicOrder(), TopicOrder()

    def forget(self) -> None:
        """Discard all samples."""
        self._stood = None
        self._begin_anew()

    def _begin_anew(self) -> None:
        self.since, self._began, self._count = None, None, 0

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
        measured = (
            self._count >= LIMITS.standing_samples
            and (moment.since(self._began) or 0.0) >= LIMITS.standing_for_s
            and not self._moved_lately(moment, at)
        )
        if measured and self._stood is None:
            self._stood = self._began, self.since
        return measured

    def _moved_lately(self, moment: StandstillMoment, at: Instant) -> bool:
        """Whether a wheel moved in the last half second."""
        if self._moved is None:
            return False
        ago = moment.since(self._moved)
        # Where the robot's clock does not tell, the arrival must.
        ago = at.mono - self._moved_at if ago is None else ago
        return ago < LIMITS.standing_gap_s

    def odometry(
        self,
        at: Instant,
        origin: Origin = UNKNOWN_ORIGIN,
        age_s: float = inf,
        *,
        moves: bool,
    ) -> bool | None:
        """Take one sample of odometry, proven to be no older than ``age_s``.

        Returns:
            Whether several in a row have moved; None for one from before the rest,
            which says nothing of it.
        """
        moment = self._odometry.moment(origin, at)
        if self._is_before_the_rest(moment, at.mono - age_s):
            return None
        self._moving_samples = self._moving_samples + 1 if moves else 0
        if moves:
            self._moved, self._moved_at = moment, at.mono
        return self._moving_samples >= LIMITS.standing_contradicted_by

    def _is_before_the_rest(self, moment: StandstillMoment, not_before: float) -> bool:
        """Whether the robot's own clock says so, and nothing proves it wrong."""
        began, since = self._stood or (self._began, self.since)
        if began is None or since is None or moment.boot is None:
            return False
        after = moment.since(began)
        return after is not None and after <= 0.0 and not_before <= since.mono
