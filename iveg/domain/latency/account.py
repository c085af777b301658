"""The numbers of the latency page: each hop of each kind of data over one window.

Collecting is quick and belongs to the loop, since streams live there; merging and
summing up need finished sketches alone and may be done in any thread.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from iveg.domain.latency.segments import DATA, SEGMENTS, Data, Segment, Window
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.stream import Stream

Cell = tuple[Data, Segment]


@dataclass(frozen=True, slots=True)
class LatencySummary:
    """One hop of one kind of data (s); None where nothing was measured."""

    count: int
    mean: float | None
    p50: float | None
    p95: float | None
    p99: float | None
    least: float | None
    most: float | None


def collect(
    streams: Iterable[Stream], window: Window, robot_id: str | None = None
) -> dict[Cell, list[Sketch]]:
    """The finished sketches of a window, of one robot or of all; for the loop."""
    found: dict[Cell, list[Sketch]] = {
        (data, hop): [] for data in DATA for hop in SEGMENTS
    }
    for stream in streams:
        if robot_id in (None, stream.robot_id):
            for hop, series in stream.segments.items():
                found[stream.data, hop] += series.parts(window)
    return found


def merge(parts: Mapping[Cell, list[Sketch]]) -> dict[Cell, Sketch]:
    """One sketch a cell; for any thread."""
    return {cell: merged(sketches) for cell, sketches in parts.items()}


def spread_of(sketch: Sketch) -> LatencySummary:
    """Its numbers."""
    if not sketch.count:
        return LatencySummary(0, None, None, None, None, None, None)
    return LatencySummary(
        sketch.count,
        sketch.mean,
        sketch.quantile(0.50),
        sketch.quantile(0.95),
        sketch.quantile(0.99),
        sketch.least,
        sketch.most,
    )
