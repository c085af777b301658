"""What a robot may drive at most: the lowest of its caps, lowered at once, raised late.

Factors are 0, 0.5 or 1 and never multiplied (docs/safety.md): two zones that overlap
still halve.  A raw cap that goes down counts immediately; one that goes up must stay up
for a second first, and what came lower in that second counts.
"""

from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.limits import LIMITS

_REASONS = ("clear", "stale", "watchdog", "robot", "person")
"""What a report may give as reason for a cap; at equal factors the last one is told."""


@dataclass(frozen=True, slots=True)
class Cap:
    """One reason not to drive faster than ``factor``."""

    factor: float
    reason: str
    cause: str | None = None
    decision_id: str | None = None

    def _order(self) -> tuple[float, int, bool]:
        return self.factor, -_REASONS.index(self.reason), self.cause is None


FREE = Cap(FULL_SPEED, "clear")


def quantised(factor: float) -> float:
    """The allowed factor that is not above a given one."""
    if factor >= FULL_SPEED:
        return FULL_SPEED
    return HALF_SPEED if factor >= HALF_SPEED else 0.0


def known_reason(reason: str) -> str:
    """A reason that a report may carry; an unheard-of one is told as ``stale``."""
    return reason if reason in _REASONS and reason != "clear" else "stale"


def lowest(caps: Iterable[Cap]) -> Cap:
    """The cap that counts: the lowest factor, people before robots before silence."""
    asked = [cap for cap in caps if cap is not FREE]
    return min((*asked, FREE), key=Cap._order) if asked else FREE


@dataclass(frozen=True, slots=True)
class AppliedCap:
    """The cap that is in force, and the one that waits to replace it.

    Attributes:
        waiting: Lowest raw cap since ``since``, all above ``cap``; None: nothing waits.
    """

    cap: Cap
    waiting: Cap | None = None
    since: float = 0.0

    def settle(self, raw: Cap, now: float) -> "AppliedCap":
        """Take the raw cap of this moment: down at once, up after 1.0 s."""
        if raw is self.cap and self.waiting is None:
            return self
        if raw.factor <= self.cap.factor:
            return AppliedCap(raw)
        if self.waiting is None:
            return AppliedCap(self.cap, raw, now)
        waiting = lowest((self.waiting, raw))
        if now - self.since < LIMITS.release_after_s:
            return AppliedCap(self.cap, waiting, self.since)
        return AppliedCap(waiting).settle(raw, now)
