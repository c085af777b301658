"""Offset of a robot's clock from ours, within bounds that its echoes prove.

A message was measured after the feedback that its robot had received was composed (F),
and before it arrived (R).  Its stamp S therefore bounds the offset θ = robot − server::

    S − R  <=  θ  <=  S − F          each message, R and F on the server's clock

The narrowest bounds of the last one to two minutes count.  If they contain zero, the
clock counts as in step, like a clock that follows NTP.  A delay on the way up and a
clock that is behind look alike (docs/safety.md, "Age"); the bounds say how wrong that
may be.  If they exclude zero and are narrow, their middle counts.

A message that contradicts the bounds is not used: the clock was set, and new bounds
begin with it.
"""

from typing import Final, Literal, NamedTuple

from iveg.domain.observations import Instant

STAMP_S: Final = 0.001
"""Resolution of a stamp (s): an offset within it counts as zero."""
LONGEST_S: Final = 60.0
"""Greatest transit that counts (s): else the stamp is wrong or the message replayed."""
TRUSTED_S: Final = 0.1
"""Greatest half width of bounds that exclude zero (s)."""
_WINDOW_S: Final = 60.0
_TOLERANCE_S: Final = 0.02
"""Contradiction that is no set clock: stamps are rounded, clocks slewed (s)."""
_LEAP_S: Final = 0.5
"""Least leap into the future that is found without an upper bound (s)."""
_INF: Final = float("inf")

State = Literal["in_step", "assumed", "corrected", "untrusted", "unknown"]
"""``assumed``: zero is possible, but nothing bounds the offset from above, since the
robot does not echo."""


class Bounds(NamedTuple):
    """Lower and upper bound of the offset (s)."""

    low: float = -_INF
    high: float = _INF

    def within(self, other: "Bounds") -> "Bounds":
        """Intersection of both bounds; empty (low > high) if they contradict."""
        return Bounds(max(self.low, other.low), min(self.high, other.high))


_ANYTHING: Final = Bounds()


class ClockOffset:
    """The known offset of one robot's clock.

    Attributes:
        bounds: Bounds by the messages of the last one to two minutes.
        state: Trust in the clock.
        offset_s: Robot's clock less ours (s), as it is used; None: not trusted.
    """

    def __init__(self) -> None:
        self.bounds = self._older = self._newer = _ANYTHING
        self.state: State = "unknown"
        self.offset_s: float | None = None
        self._since = -_INF

    def time_message(
        self, stamp_s: float, at: Instant, composed_at: float | None
    ) -> float | None:
        """Take one message; returns its transit (s), or None if that is unknown.

        Args:
            stamp_s: Stamp by the robot's clock (Unix s).
            at: Time of arrival.
            composed_at: When the feedback that it echoes was composed, on our monotonic
                clock (s); None: it echoes nothing.
        """
        low = stamp_s - at.wall
        if composed_at is None and low < -LONGEST_S:
            self.state, self.offset_s = "untrusted", None
            return None
        high = _INF if composed_at is None else low + max(0.0, at.mono - composed_at)
        bounds = Bounds(low, high)
        if self._is_jump(bounds):
            self._older, self._newer, self._since = _ANYTHING, bounds, at.mono
            self._settle()
            return None
        self._note(bounds, at.mono)
        if self.offset_s is None or self.offset_s - low < -STAMP_S:
            return None
        return max(0.0, self.offset_s - low)

    @property
    def uncertainty_s(self) -> float | None:
        """Greatest error of ``offset_s`` (s); None: unbounded."""
        offset, bounds = self.offset_s, self.bounds
        if offset is None or bounds.high == _INF:
            return None
        return max(0.0, offset - bounds.low, bounds.high - offset)

    def _is_jump(self, newest: Bounds) -> bool:
        both = self.bounds.within(newest)
        if both.low > both.high + _TOLERANCE_S:
            return True
        # Without an upper bound only its size shows a leap into the future.
        is_open = self.bounds.high == _INF and self.bounds.low > -_INF
        return is_open and newest.low > max(0.0, self.bounds.low) + _LEAP_S

    def _note(self, newest: Bounds, now: float) -> None:
        # Two windows, so that bounds are forgotten after one to two minutes.
        if now - self._since >= _WINDOW_S:
            self._older, self._newer, self._since = self._newer, newest, now
        else:
            self._newer = self._newer.within(newest)
        both = self._older.within(self._newer)
        if both.low > both.high:
            # Slewed by a few milliseconds: the newest message is right.
            self._older, self._newer = _ANYTHING, newest
        self._settle()

    def _settle(self) -> None:
        """Derive offset and state from the bounds."""
        bounds = self.bounds = self._older.within(self._newer)
        if bounds.low <= STAMP_S and bounds.high >= -STAMP_S:
            self.state = "assumed" if bounds.high == _INF else "in_step"
            self.offset_s = 0.0
        elif (bounds.high - bounds.low) / 2 <= TRUSTED_S:
            self.state, self.offset_s = "corrected", (bounds.low + bounds.high) / 2
        else:
            self.state, self.offset_s = "untrusted", None
