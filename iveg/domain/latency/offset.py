"""How far a robot's clock is from ours, with its uncertainty: proven, not guessed.

A message was measured after the feedback that its robot had heard was composed (F), and
before it arrived (R).  Its stamp S therefore bounds the offset θ = robot − server::

    S − R  <=  θ  <=  S − F          each message, R and F on the server's clock

The narrowest bounds of the last one to two minutes count.  A clock that they do not
disprove is taken to be in step, as clocks are that follow NTP: from one side a delay on
the way up and a clock that is behind look alike (docs/safety.md, "Age"), and the bounds
say how wrong that may be.  Where they rule zero out, the middle counts, if they are
narrow.

::

    contradicts the bounds ──> unused until five agree ──> new bounds: it was set
"""

from dataclasses import dataclass
from typing import Final, Literal

from iveg.domain.latency.segments import LONGEST_S, STAMP_S, Exclusion
from iveg.domain.observations import Instant

AGREE: Final = 5
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
        jumps: How often it was set while iVeg looked.
    """

    def __init__(self) -> None:
        self.bounds = self._older = self._newer = _ANYTHING
        self.state: State = "unknown"
        self.offset_s: float | None = None
        self.jumps = 0
        self._since = -_INF
        self._suspects: list[Bounds] = []

    def time_message(
        self, stamp_s: float, at: Instant, composed_at: float | None
    ) -> float | Exclusion:
        """Take one message; returns its transit (s), or the reason for none.

        Args:
            stamp_s: By the robot's clock (Unix s).
            at: When it arrived.
            composed_at: When the feedback that it had heard was composed, on our
                monotonic clock (s); None where it echoes nothing.
        """
        low = stamp_s - at.wall
        if composed_at is None and low < -LONGEST_S:
            self.state, self.offset_s = "untrusted", None
            return "stale_stamp"
        high = _INF if composed_at is None else low + max(0.0, at.mono - composed_at)
        if self._is_jump(low, high):
            return self._suspect(Bounds(low, high), at.mono)
        if self._suspects or self.offset_s is None or self._tells_more(low, high, at):
            self._suspects.clear()
            self._note(Bounds(low, high), at.mono)
        if self.offset_s is None:
            return "clock_untrusted"
        took = self.offset_s - low
        if took < -STAMP_S:
            return "negative"
        return max(0.0, took)

    @property
    def uncertainty_s(self) -> float | None:
        """Greatest error of ``offset_s`` (s); None where nothing bounds it."""
        offset, bounds = self.offset_s, self.bounds
        if offset is None or bounds.high == _INF:
            return None
        return max(0.0, offset - bounds.low, bounds.high - offset)

    def _is_jump(self, low: float, high: float) -> bool:
        known = self.bounds
        if low > known.high + _TOLERANCE_S or high < known.low - _TOLERANCE_S:
            return True
        # Nothing bounds it from above: a leap into the future shows itself by its size.
        return (
            known.high == _INF
            and known.low > -_INF
            and low > max(0.0, known.low) + _SAME_S
        )

    def _suspect(self, bounds: Bounds, now: float) -> Exclusion:
        if self._suspects and abs(bounds.low - self._suspects[0].low) > _SAME_S:
            self._suspects.clear()
        self._suspects.append(bounds)
        if len(self._suspects) >= AGREE:
            agreed = _ANYTHING
            for one in self._suspects:
                agreed = agreed.within(one)
            self._suspects.clear()
            self.jumps += 1
            self._older, self._newer, self._since = _ANYTHING, agreed, now
            self._settle()
        return "clock_jump"

    def _tells_more(self, low: float, high: float, at: Instant) -> bool:
        newer = self._newer
        is_due = at.mono - self._since >= _WINDOW_S
        return is_due or low > newer.low or high < newer.high

    def _note(self, bounds: Bounds, now: float) -> None:
        if now - self._since >= _WINDOW_S:
            self._older, self._newer, self._since = self._newer, bounds, now
        else:
            self._newer = self._newer.within(bounds)
        both = self._older.within(self._newer)
        if both.low > both.high:
            # Slewed by a few milliseconds: the newest message is right.
            self._older, self._newer = _ANYTHING, bounds
        self._settle()

    def _settle(self) -> None:
        """Derive offset and uncertainty from the bounds."""
        bounds = self.bounds = self._older.within(self._newer)
        if bounds.low <= STAMP_S and bounds.high >= -STAMP_S:
            self.state = "assumed" if bounds.high == _INF else "in_step"
            self.offset_s = 0.0
        elif (bounds.high - bounds.low) / 2 <= TRUSTED_S:
            self.state, self.offset_s = "corrected", (bounds.low + bounds.high) / 2
        else:
            self.state, self.offset_s = "untrusted", None
