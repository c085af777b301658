"""Many durations in little room: counts by logarithmic bins, quantiles within 1 %.

The bins and the quantiles are DDSketch's (Masson, Rim, Lee: VLDB 2019), from its
authors' library.  Durations are put into bins many at a time, because the library's
way of one by one costs four microseconds each, and a sketch that is finished never
changes: it may be merged in another thread while the next one fills.
"""

import zlib
from base64 import b64decode, b64encode
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
from ddsketch import DDSketch
from ddsketch.mapping import LogarithmicMapping
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError

ACCURACY: Final = 0.01
"""A quantile is off by this share of itself at most."""
_SHORTEST_S, _LONGEST_S = 1e-6, 600.0
"""What is shorter or longer counts as these, which bounds the bins to 1,012."""
_MAPPING = LogarithmicMapping(ACCURACY)
_LOG_GAMMA = float(np.log(_MAPPING.gamma))


@dataclass(frozen=True)
class Sketch:
    """Durations of one hop over some time.

    Attributes:
        count: How many were measured.
        total: Their sum (s); ``least`` and ``most`` (s), all exact.
        keys: Shape (n,): bins that are not empty, rising.
        counts: Shape (n,): how many fell into each.
    """

    count: int = 0
    total: float = 0.0
    least: float = float("inf")
    most: float = 0.0
    keys: NDArray[np.int16] = field(default_factory=lambda: np.empty(0, np.int16))
    counts: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    @property
    def mean(self) -> float | None:
        """(s); None of nothing."""
        return self.total / self.count if self.count else None

    def quantile(self, share: float) -> float | None:
        """The quantile of a share (0 to 1) (s), within 1 %; None without data."""
        value = self._filled.get_quantile_value(share)
        return None if value is None else min(max(float(value), self.least), self.most)

    def bins(self) -> tuple[list[float], list[int]]:
        """Upper ends of its bins (s), the same for all sketches, and their counts."""
        return np.exp(self.keys * _LOG_GAMMA).tolist(), self.counts.tolist()

    def distribution(self) -> tuple[list[float], list[float]]:
        """Rising durations (s), and the share (0 to 1) that did not exceed each."""
        edges = np.minimum(np.exp(self.keys * _LOG_GAMMA), self.most)
        shares = np.cumsum(self.counts) / max(1, self.count)
        return edges.tolist(), shares.tolist()

    @cached_property
    def _filled(self) -> DDSketch:
        filled = DDSketch(ACCURACY)
        for key, count in zip(self.keys.tolist(), self.counts.tolist(), strict=True):
            filled.add(_MAPPING.value(key), count)
        return filled


NOTHING: Final = Sketch()


def sketch_of(durations: Sequence[float]) -> Sketch:
    """Durations (s, not below zero) as a sketch."""
    if not durations:
        return NOTHING
    values = np.asarray(durations, np.float64)
    inside = np.clip(values, _SHORTEST_S, _LONGEST_S)
    keys, counts = np.unique(
        np.ceil(np.log(inside) / _LOG_GAMMA).astype(np.int16), return_counts=True
    )
    return Sketch(
        values.size,
        float(values.sum()),
        float(values.min()),
        float(values.max()),
        keys,
        counts.astype(np.int64),
    )


def from_bins(edges: Sequence[float], counts: Sequence[int], total: float) -> Sketch:
    """What ``Sketch.bins`` told, and the sum (s); least and most are those of bins."""
    if not edges:
        return NOTHING
    ends = np.asarray(edges, np.float64)
    keys = np.rint(np.log(ends) / _LOG_GAMMA).astype(np.int16)
    weights = np.asarray(counts, np.int64)
    least = float(ends[0]) / _MAPPING.gamma
    return Sketch(int(weights.sum()), total, least, float(ends[-1]), keys, weights)


def merged(sketches: Iterable[Sketch]) -> Sketch:
    """All of them as one: as if their durations had gone into it."""
    parts = [one for one in sketches if one.count]
    if len(parts) < 2:
        return parts[0] if parts else NOTHING
    keys, places = np.unique(
        np.concatenate([one.keys for one in parts]), return_inverse=True
    )
    weights = np.concatenate([one.counts for one in parts])
    return Sketch(
        sum(one.count for one in parts),
        sum(one.total for one in parts),
        min(one.least for one in parts),
        max(one.most for one in parts),
        keys,
        np.bincount(places, weights).astype(np.int64),
    )


def write_bins(sketch: Sketch) -> str:
    """Its bins as a short text, for the history."""
    raw = sketch.keys.astype("<i2").tobytes() + sketch.counts.astype("<u4").tobytes()
    return b64encode(zlib.compress(raw)).decode()


def read_bins(text: str) -> tuple[NDArray[np.int16], NDArray[np.int64]]:
    """Keys and counts of ``write_bins``.

    Raises:
        UnreadableError: it is none of its texts.
    """
    try:
        raw = zlib.decompress(b64decode(text, validate=True))
        size, rest = divmod(len(raw), 6)
        if rest:
            raise ValueError("half a bin")
        keys = np.frombuffer(raw, "<i2", size).astype(np.int16)
        counts = np.frombuffer(raw, "<u4", size, 2 * size).astype(np.int64)
    except (ValueError, zlib.error) as error:
        raise UnreadableError("not_bins", str(error)) from error
    return keys, counts
