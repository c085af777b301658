"""Speed caps of a robot: the lowest applies, at once when lower, delayed when higher.

Factors are 0, 0.5 or 1 and are never multiplied (docs/safety.md): two overlapping zones
still halve the speed.  A raw cap that falls applies immediately; one that rises must
stay up for one second first, and a lower cap within that second counts.  A cap that is
told to be over, and is lifted by itself a second later, waits for no second one.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.limits import LIMITS

_REASONS = (
    *("clear", "unsupervised", "stale", "doubt", "watchdog"),
    *("obstacle", "robot", "person"),
)
"""Reasons of a cap in a report; at equal factors the later one is reported."""


@dataclass(frozen=True, slots=True)
class Cap:
    """One reason not to drive faster than ``factor``.

    Attributes:
        waits: Whether it is lifted a second after it is heard no more; else its reason
            has ended, and that second is counted while it is still heard.
    """

    factor: float
    reason: str
    cause: str | None = None
    decision_id: str | None = None
    waits: bool = field(default=True, compare=False)

    def _order(self) -> tuple[float, int, bool, bool]:
        reason = -_REASONS.index(self.reason)
        return self.factor, reason, self.cause is None, self.decision_id is None


FREE = Cap(FULL_SPEED, "clear")


def quantised(factor: float) -> float:
    """Largest allowed factor that is not above the given one."""
    if factor >= FULL_SPEED:
        return FULL_SPEED
    return HALF_SPEED if factor >= HALF_SPEED else 0.0


def known_reason(reason: str) -> str:
    """Reason that a report may carry; an unknown one is reported as ``stale``."""
    return reason if reason in _REASONS and reason != "clear" else "stale"


def lowest(caps: Iterable[Cap]) -> Cap:
    """The effective cap: lowest factor; if equal, people, then robots, then silence."""
    asked = [cap for cap in caps if cap is not FREE]
    return min((*asked, FREE), key=Cap._order) if asked else FREE


@dataclass(frozen=True, slots=True)
class AppliedCap:
    """The cap in force and a pending higher one.

    Attributes:
        waiting: Lowest raw cap since ``since``, all above ``cap``; None: no change.
    """

    cap: Cap
    waiting: Cap | None = None
    since: float = 0.0

    def settle(self, raw: Cap, now: float) -> "AppliedCap":
        """Apply the present raw cap: a lower one at once, a higher one after 1.0 s."""
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
