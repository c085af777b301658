"""Offset of a robot's clock from ours, within bounds that its echoes prove.

A message was measured after the feedback that its robot had received was composed (F),
and before it arrived (R).  Its stamp S therefore bounds the offset θ = robot − server::

    S − R  <=  θ  <=  S − F          each message, R and F on the server's clock

The narrowest bounds of the last one to two minutes count.  A clock that they do not
disprove is taken to be in step, as clocks are that follow NTP: from one side a delay on
the way up and a clock that is behind look alike (docs/safety.md, "Age"), and the bounds
say how wrong that may be.  Where they rule zero out, the middle counts, if they are
narrow.

A message that contradicts the bounds is not used: the clock was set, and new bounds
begin with it.
"""

from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.observations import Instant

STAMP_S: Final = 0.001
"""Resolution of a stamp (s): what lies below zero by less is zero."""
LONGEST_S: Final = 60.0
"""A longer time is not counted: the stamp is wrong, or the message was replayed."""
TRUSTED_S: Final = 0.1
"""Half the width of bounds (s) that an offset other than zero may have."""
_WINDOW_S: Final = 60.0
_TOLERANCE_S: Final = 0.02
"""Stamps are rounded and clocks are slewed: by less no clock was set."""
_SAME_S: Final = 0.5
_INF: Final = float("inf")

State = Literal["in_step", "assumed", "corrected", "untrusted", "unknown"]
"""``assumed``: nothing disproves it, and nothing bounds it from above, because the
robot does not echo."""


@dataclass(frozen=True, slots=True)
class Bounds:
    """The offset lies between these (s)."""

    low: float = -_INF
    high: float = _INF

    def within(self, other: "Bounds") -> "Bounds":
        """Intersection of both bounds; empty (low > high) if they contradict."""
        return Bounds(max(self.low, other.low), min(self.high, other.high))


_ANYTHING: Final = Bounds()


class ClockOffset:
    """The known offset of one robot's clock.

    Attributes:
        bounds: What the last one to two minutes prove.
        state: How far the clock can be believed.
        offset_s: Robot's clock less ours (s), as it is used; None where not trusted.
    """

    def __init__(self) -> None:
        self.bounds = self._older = self._newer = _ANYTHING
        self.state: State = "unknown"
        self.offset_s: float | None = None
        self._since = -_INF

    def time_message(
        self, stamp_s: float, at: Instant, composed_at: float | None
    ) -> float | None:
        """Take one message; returns its transit (s), or None where nothing tells it.

        Args:
            stamp_s: By the robot's clock (Unix s).
            at: When it arrived.
            composed_at: When the feedback that it had received was composed, on our
                monotonic clock (s); None where it echoes nothing.
        """
        low = stamp_s - at.wall
        if composed_at is None and low < -LONGEST_S:
            self.state, self.offset_s = "untrusted", None
            return None
        high = _INF if composed_at is None else low + max(0.0, at.mono - composed_at)
        found = Bounds(low, high)
        if self._is_jump(found):
            self._older, self._newer, self._since = _ANYTHING, found, at.mono
            self._settle()
            return None
        self._note(found, at.mono)
        if self.offset_s is None or self.offset_s - low < -STAMP_S:
            return None
        return max(0.0, self.offset_s - low)

    @property
    def uncertainty_s(self) -> float | None:
        """Greatest error of ``offset_s`` (s); None where nothing bounds it."""
        offset, bounds = self.offset_s, self.bounds
        if offset is None or bounds.high == _INF:
            return None
        return max(0.0, offset - bounds.low, bounds.high - offset)

    def _is_jump(self, found: Bounds) -> bool:
        both = self.bounds.within(found)
        if both.low > both.high + _TOLERANCE_S:
            return True
        # Nothing bounds it from above: a leap into the future shows itself by its size.
        is_open = self.bounds.high == _INF and self.bounds.low > -_INF
        return is_open and found.low > max(0.0, self.bounds.low) + _SAME_S

    def _note(self, found: Bounds, now: float) -> None:
        if now - self._since >= _WINDOW_S:
            self._older, self._newer, self._since = self._newer, found, now
        else:
            self._newer = self._newer.within(found)
        both = self._older.within(self._newer)
        if both.low > both.high:
            # Slewed by a few milliseconds: the newest message is right.
            self._older, self._newer = _ANYTHING, found
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
