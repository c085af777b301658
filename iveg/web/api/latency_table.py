"""The latency table: read in the loop from streams of measures, written elsewhere."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any, Literal

import orjson
from pydantic import BaseModel, ConfigDict, Field

from iveg.domain.latency.account import Cell
from iveg.domain.latency.offset import ClockOffset
from iveg.domain.latency.paper import PAPER
from iveg.domain.latency.segments import DATA, SEGMENTS, WINDOW_S, Data, Segment, Window
from iveg.domain.latency.sequence_loss import SequenceLoss
from iveg.domain.latency.sketch import Sketch
from iveg.domain.latency.stream import Stream
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.base import write_json
from iveg.models.latency import (
    LatencyClock,
    LatencyRow,
    LatencyStream,
    LatencyTable,
    LatencyTrace,
    SegmentBins,
    SegmentOrder,
    SegmentRemark,
    SegmentSpread,
)
from iveg.web.api.exports import cell, csv_lines
from iveg.web.pages import plotly_library
from iveg.web.pages.latency_figures import (
    bars_figure,
    cdf_figure,
    steps_of,
    trace_figure,
)


class Asked(BaseModel):
    """Window and robot of the question."""

    model_config = ConfigDict(extra="forbid")

    window: Window = Field("15min", description="1min, 15min or 24h")
    robot: str | None = Field(
        None, pattern=r"^[A-Za-z0-9-]{1,64}$", description="Robot id; all unless told"
    )
    figures: bool = Field(True, description="Whether to draw them, too")
    bins: bool = Field(False, description="Whether to tell the whole distributions")
    format: Literal["json", "csv"] | None = Field(
        None, description="Instead of an `Accept` header"
    )


def members_of(
    watch: LatencyWatch, streams: list[Stream], asked: Asked, now: Instant
) -> dict[str, object]:
    """Values read from the streams, in the loop's thread."""
    return {
        "at": format_stamp(now.wall),
        "window": asked.window,
        "window_s": WINDOW_S[asked.window],
        "robot": asked.robot,
        "paper": {
            place: {data: asdict(row) for data, row in rows.items()}
            for place, rows in PAPER.items()
        },
        "clocks": [
            _clock(robot_id, one)
            for robot_id, one in watch.clocks.items()
            if asked.robot in (None, robot_id)
        ],
        "pages_within_ms": _ms(watch.pages_within_s),
        "streams": [_stream(one) for one in streams],
        "remarks": [
            SegmentRemark(key=one.key, hop=one.hop, slots=dict(one.slots))
            for one in watch.overloads.remarks
        ],
        "trace": _newest_trace(streams),
    }


def write_table(
    sketches: Mapping[Cell, Sketch],
    members: dict[str, Any],
    sampled: Mapping[Data, list[Segment]],
    asked: Asked,
) -> bytes:
    """The whole answer; in the worker."""
    figures = {}
    if asked.figures:
        figures = {
            "bars": bars_figure(sketches),
            "cdf": cdf_figure(sketches),
            "trace": trace_figure(members["trace"]),
        }
    answer = LatencyTable(
        **members,
        direct=any(sketches[data, "uplink"].count for data in DATA),
        rows=[
            _row(data, sketches, sampled[data], with_bins=asked.bins) for data in DATA
        ],
        **plotly_library.library_facts(),
        figures={name: orjson.Fragment(figure) for name, figure in figures.items()},
    )
    # Member by member, as only orjson knows what to do with a figure that is drawn.
    return write_json(vars(answer))


def _newest_trace(streams: Iterable[Stream]) -> LatencyTrace | None:
    traced = ((one, one.tracer.newest) for one in streams)
    known = [(one, trace) for one, trace in traced if trace is not None]
    if not known:
        return None
    stream, newest = max(known, key=lambda pair: pair[1].heard_at)
    return LatencyTrace(
        robot_id=stream.robot_id,
        data=stream.data,
        stamp=newest.stamp,
        steps=steps_of(newest),
    )


def _row(
    data: Data,
    sketches: Mapping[Cell, Sketch],
    sampled: list[Segment],
    *,
    with_bins: bool,
) -> LatencyRow:
    hops = {hop: sketches[data, hop] for hop in SEGMENTS}
    return LatencyRow(
        data=data,
        hops={hop: _spread(sketch) for hop, sketch in hops.items()},
        sampled=list(sampled),
        bins={hop: _bins(one) for hop, one in hops.items()} if with_bins else None,
    )


def _bins(of: Sketch) -> SegmentBins:
    edges, counts = of.bins()
    return SegmentBins(
        edges_ms=[float(f"{1000.0 * edge:.6g}") for edge in edges],
        counts=counts,
        total_ms=round(1000.0 * of.total, 3),
    )


def sampled_hops(streams: Iterable[Stream]) -> dict[Data, list[Segment]]:
    """Hops that measure only some messages: Orion is throttled, pages are paced."""
    throttled = {one.data for one in streams if one.is_throttled}
    return {
        data: [*(("fiware", "robot_orion") if data in throttled else ()), "screen"]
        for data in DATA
    }


def _spread(of: Sketch) -> SegmentSpread:
    return SegmentSpread(
        count=of.count,
        mean_ms=_ms(of.mean),
        p50_ms=_ms(of.quantile(0.50)),
        p95_ms=_ms(of.quantile(0.95)),
        p99_ms=_ms(of.quantile(0.99)),
        least_ms=_ms(of.least if of.count else None),
        most_ms=_ms(of.most if of.count else None),
    )


def _clock(robot_id: str, of: ClockOffset) -> LatencyClock:
    return LatencyClock(
        robot_id=robot_id,
        state=of.state,
        offset_ms=_ms(of.offset_s),
        uncertainty_ms=_ms(of.uncertainty_s),
        jumps=of.jumps,
    )


def _stream(of: Stream) -> LatencyStream:
    rates = of.rates
    excluded: dict[str, dict[str, int]] = {}
    for (hop, why), count in of.excluded.items():
        excluded.setdefault(hop, {})[why] = count
    return LatencyStream(
        robot_id=of.robot_id,
        data=of.data,
        heard_hz=round(rates.heard, 1),
        agent_hz=round(rates.agent, 1),
        orion_hz=round(rates.orion, 1),
        kept_back=round(1.0 - rates.agent / rates.heard, 2) if rates.heard else None,
        throttled=of.is_throttled,
        orion_first=of.orion_first,
        uplink=_order(of.up),
        fiware=_order(of.fiware),
        excluded=excluded,
    )


def _order(of: SequenceLoss) -> SegmentOrder:
    return SegmentOrder(
        passed=of.passed,
        missing=of.missing,
        reordered=of.reordered,
        repeated=of.repeated,
        skipped=of.skipped,
    )


def write_csv(sketches: Mapping[Cell, Sketch]) -> bytes:
    """One line a kind of data and hop."""
    names = list(SegmentSpread.model_fields)
    rows = [["data", "hop", *names]]
    for (data, hop), sketch in sketches.items():
        spread = vars(_spread(sketch))
        rows.append([data, hop, *(cell(name, spread[name]) for name in names)])
    return csv_lines(rows)


def _ms(seconds: float | None) -> float | None:
    return None if seconds is None else round(1000.0 * seconds, 2)
