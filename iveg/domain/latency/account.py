"""What the latency page tells: each hop of each kind of data over one window.

Collecting is quick and belongs to the loop, since streams live there; merging needs
finished sketches alone and may be done in any thread.
"""

from collections.abc import Iterable, Mapping

from iveg.domain.latency.segments import DATA, SEGMENTS, Data, Segment, Window
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.stream import Stream

Cell = tuple[Data, Segment]


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
