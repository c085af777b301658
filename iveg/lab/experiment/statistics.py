"""Confidence intervals of shares and of their differences."""

from dataclasses import dataclass
from math import sqrt
from typing import Final, Literal

_Z: Final = 1.959964
"""Normal quantile for 95 %."""
FEWEST_RUNS: Final = 5
"""For a bootstrapped interval; five may all change one way by chance, 1 in 16."""
Verdict = Literal["better", "worse", "cannot tell"]


@dataclass(frozen=True, slots=True)
class Interval:
    """A share with its 95 % interval; all 0 to 1."""

    share: float
    low: float
    high: float


def wilson(hits: float, of: float) -> Interval | None:
    """The Wilson score interval (Wilson 1927); None without data."""
    if of <= 0:
        return None
    share, z2 = hits / of, _Z * _Z
    middle = (share + z2 / (2 * of)) / (1 + z2 / of)
    half = _Z / (1 + z2 / of) * sqrt(share * (1 - share) / of + z2 / (4 * of * of))
    return Interval(share, max(0.0, middle - half), min(1.0, middle + half))


def thinned(hits: int, of: int, worth: int) -> Interval | None:
    """The same where ``of`` counts are worth only ``worth`` independent ones."""
    return wilson(hits * worth / of, worth) if of and worth else None


def difference(before: Interval, after: Interval) -> Interval:
    """After less before, with Newcombe's interval (1998, method 10)."""
    apart = after.share - before.share
    low = apart - sqrt(
        (after.share - after.low) ** 2 + (before.high - before.share) ** 2
    )
    high = apart + sqrt(
        (after.high - after.share) ** 2 + (before.share - before.low) ** 2
    )
    return Interval(apart, low, high)


def verdict(apart: Interval) -> Verdict:
    """Whether a share that should be high improved."""
    if apart.low > 0.0:
        return "better"
    return "worse" if apart.high < 0.0 else "cannot tell"
