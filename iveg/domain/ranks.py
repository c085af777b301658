"""Percentiles of few measured values."""

from collections.abc import Sequence
from math import ceil


def nearest_rank(known: Sequence[float], share: float) -> float | None:
    """Nearest-rank percentile of sorted values (``share`` 0 to 1); None without any."""
    return known[max(0, ceil(share * len(known)) - 1)] if known else None
