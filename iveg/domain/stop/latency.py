"""Latency of STOP over many STOPs: median, 95th percentile and maximum."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil


@dataclass(frozen=True, slots=True)
class StopLatency:
    """Times of one step (ms); None where nothing was measured.

    Attributes:
        count: How many were measured.
        p50: That half of them did not exceed (nearest rank); ``p95`` likewise.
        longest: The maximum.
    """

    count: int
    p50: float | None
    p95: float | None
    longest: float | None


def spread(values: Iterable[float | None]) -> StopLatency:
    """Summarise measured times; missing ones are left out and not counted."""
    known = sorted(value for value in values if value is not None)
    if not known:
        return StopLatency(0, None, None, None)
    return StopLatency(
        len(known), nearest_rank(known, 0.50), nearest_rank(known, 0.95), known[-1]
    )


def nearest_rank(known: list[float], share: float) -> float:
    """Nearest-rank percentile of sorted values, for a share from 0 to 1."""
    return known[max(0, ceil(share * len(known)) - 1)]
