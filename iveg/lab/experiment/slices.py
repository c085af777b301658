"""Latencies in slices of a few seconds.

Δt₁ and Δt₂ are of messages that were timed at the broker and at Orion; Δt₃ is iVeg's
own account: its API reports totals since its start, and the difference of two responses
is a slice.  The slices of all runs add up to the experiment, and resampling them gives
the interval of a mean or a quantile: messages of one slice are not independent.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, TypedDict

import numpy as np
from numpy.typing import NDArray

from iveg.domain.latency.account import Cell
from iveg.domain.latency.segments import DATA, SEGMENTS, Segment
from iveg.domain.latency.sketch import Sketch, from_bins, merged, sketch_of
from iveg.domain.records import Json
from iveg.lab.experiment.message_times import MessageTimes
from iveg.lab.experiment.statistics import FEWEST_RUNS, Interval


class Bins(TypedDict):
    """Durations as ``GET /latency?bins=true`` has them."""

    edges_ms: list[float]
    counts: list[int]
    total_ms: float


Slice = dict[str, dict[str, Bins]]
"""By kind of data and hop; empty cells are left out."""
HOPS: Final[tuple[Segment, ...]] = SEGMENTS[:4]
"""All but the last: no page is open."""
_FEWEST_SLICES: Final = 4
"""For an interval."""
_EMPTY: Final[Bins] = {"edges_ms": [], "counts": [], "total_ms": 0.0}
_DRAWS: Final = 1000
_SEED: Final = 14


def slice_between(before: Sequence[Json], after: Sequence[Json]) -> Slice:
    """Decisions (Δt₃) between two responses' ``rows``."""
    old = {row["data"]: row["bins"]["iveg"] for row in before}
    decided = {
        row["data"]: _less(row["bins"]["iveg"], old.get(row["data"], _EMPTY))
        for row in after
    }
    return {data: {"iveg": more} for data, more in decided.items() if more["counts"]}


def with_messages(decided: Slice, times: Iterable[MessageTimes]) -> Slice:
    """A slice of decisions with the messages of the same time."""
    took: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for one in times:
        for hop, duration in (one.hops or {}).items():
            took[one.data][hop].append(duration)
    return {
        data: {
            **{hop: _bins(found) for hop, found in took[data].items()},
            **decided.get(data, {}),
        }
        for data in DATA
    }


def _bins(durations: Sequence[float]) -> Bins:
    edges, counts = sketch_of(durations).bins()
    return {
        "edges_ms": [1000.0 * edge for edge in edges],
        "counts": counts,
        "total_ms": 1000.0 * sum(durations),
    }


def _less(after: Bins, before: Bins) -> Bins:
    known = dict(zip(before["edges_ms"], before["counts"], strict=True))
    bins = zip(after["edges_ms"], after["counts"], strict=True)
    more = [(edge, count - known.get(edge, 0)) for edge, count in bins]
    kept = [(edge, count) for edge, count in more if count > 0]
    total = after["total_ms"] - before["total_ms"]
    return {
        "edges_ms": [edge for edge, _ in kept],
        "counts": [count for _, count in kept],
        "total_ms": round(total, 3),
    }


def sketches_of(slices: Iterable[Slice], cell: Cell) -> list[Sketch]:
    """One hop of one kind of data, slice by slice."""
    data, hop = cell
    return [_sketch(one.get(data, {}).get(hop, _EMPTY)) for one in slices]


def _sketch(bins: Bins) -> Sketch:
    edges = [edge / 1000.0 for edge in bins["edges_ms"]]
    return from_bins(edges, bins["counts"], bins["total_ms"] / 1000.0)


def whole(slices: Sequence[Slice]) -> dict[Cell, Sketch]:
    """All slices combined."""
    cells: list[Cell] = [(data, hop) for data in DATA for hop in SEGMENTS]
    return {cell: merged(sketches_of(slices, cell)) for cell in cells}


def latency_changes(
    before: Sequence[Sequence[Slice]], after: Sequence[Sequence[Slice]], cell: Cell
) -> Iterator[tuple[str, Interval]]:
    """Increase of a hop's mean and P95 (ms), with bootstrapped intervals.

    Runs are drawn with replacement (Efron 1979), a thousand times, seeded; slices,
    where there are fewer than five runs.

    Args:
        before: Slices of each run of one experiment.
        after: Slices of each run of the other.
        cell: Kind of data, and hop.
    """
    old, new = _drawable(before, cell), _drawable(after, cell)
    if min(_filled(old), _filled(new)) < _FEWEST_SLICES:
        return
    drawn = _drawn(old, _SEED), _drawn(new, _SEED + 1)
    now = _numbers(merged(old)), _numbers(merged(new))
    for place, name in enumerate(("mean", "P95")):
        differences = drawn[1][:, place] - drawn[0][:, place]
        low, high = np.percentile(differences, (2.5, 97.5))
        middle = now[1][place] - now[0][place]
        yield name, Interval(middle, float(low), float(high))


def _drawable(runs: Sequence[Sequence[Slice]], cell: Cell) -> list[Sketch]:
    """What is drawn: messages of one run have its load of the machine in common."""
    by_run = [merged(sketches_of(slices, cell)) for slices in runs]
    if _filled(by_run) >= FEWEST_RUNS:
        return by_run
    return [one for slices in runs for one in sketches_of(slices, cell)]


def _filled(sketches: Iterable[Sketch]) -> int:
    return sum(one.count > 0 for one in sketches)


def _numbers(sketch: Sketch) -> tuple[float, float]:
    return 1000.0 * (sketch.mean or 0.0), 1000.0 * (sketch.quantile(0.95) or 0.0)


def _drawn(sketches: Sequence[Sketch], seed: int) -> NDArray[np.float64]:
    """Mean and P95 (ms) of each draw, shape (draws, 2)."""
    parts = [one for one in sketches if one.count]
    keys = np.unique(np.concatenate([one.keys for one in parts]))
    counts = np.zeros((len(parts), keys.size))
    for row, one in zip(counts, parts, strict=True):
        row[np.searchsorted(keys, one.keys)] = one.counts
    totals = np.array([one.total for one in parts])
    even = np.full(len(parts), 1.0 / len(parts))
    weights = np.random.default_rng(seed).multinomial(len(parts), even, _DRAWS)
    bins = weights @ counts
    n = bins.sum(axis=1)
    reached = np.argmax(np.cumsum(bins, axis=1) >= 0.95 * n[:, None], axis=1)
    edges = np.array(Sketch(keys=keys, counts=np.ones_like(keys, np.int64)).bins()[0])
    return np.stack((weights @ totals / n, edges[reached]), axis=1) * 1000.0
