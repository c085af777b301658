"""Rows become Plotly figures; the only importer of plotly.

The package checks every figure as it is made.  The browser draws it with the basic
bundle of the same version, which lies beside the page (docs/decisions, "What each
dependency is for").  ``meta`` names what a trace or an axis shows, and the page puts
the words in the reader's language.

Distributions of latency as curves.

Traces name what they show in ``meta``; the page gives them words and colours.

Plotly's script for the browser, packed and named by its content.

Figures over time: speed, margin, air and other equipment.
"""

import gzip
import hashlib
import importlib.resources
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, Final

from iveg.adapters.history.series import (
    CONFIDENCE_BINS,
    ClimateSeries,
    CommandLatency,
    ConfidenceCount,
    MeasurementSeries,
    SpeedSeries,
)
from iveg.domain.feedback import FULL_SPEED
from iveg.domain.fleet import FleetDescription
from iveg.domain.latency import DATA, Cell, Segment, Sketch
from iveg.domain.transports import TRANSPORTS
from iveg.vital.record import ODOMETRY_PERIOD_S

Trace = Mapping[str, object]

_BIN = 1.0 / CONFIDENCE_BINS


def confidence_figure(
    counts: Sequence[ConfidenceCount], threshold: float | None
) -> bytes:
    """Detections stacked by class over their confidence, the threshold marked."""
    traces = [
        {
            "type": "bar",
            "name": class_id,
            "meta": {"kind": "class", "class_id": class_id},
            "x": [
                round(c.least + _BIN / 2, 4) for c in counts if c.class_id == class_id
            ],
            "y": [c.count for c in counts if c.class_id == class_id],
            "width": 0.9 * _BIN,
        }
        for class_id in sorted({c.class_id for c in counts})
    ]
    layout: dict[str, object] = {"barmode": "stack", "xaxis": {"range": [0, 1]}}
    if threshold is not None:
        layout["shapes"] = [_mark(threshold, "threshold")]
    return figure_of(traces, ("confidence", "count"), layout)


def _mark(value: float, name: str) -> Trace:
    """A line over the whole height."""
    height = {"yref": "paper", "y0": 0, "y1": 1}
    return {"type": "line", "name": name, "x0": value, "x1": value, **height}


def stop_figure(latencies: Sequence[CommandLatency]) -> bytes:
    """Times of each STOP (ms): to each transport's answer, and to standing."""
    kinds: dict[str, list[float | None]] = {
        transport.id: [one.answer_ms.get(transport.id) for one in latencies]
        for transport in TRANSPORTS
    }
    kinds["standstill"] = [one.standstill_ms for one in latencies]
    traces = [
        {
            "type": "scatter",
            "mode": "markers",
            "name": kind,
            "meta": {"kind": kind},
            "x": [milliseconds(one.requested_at) for one in latencies],
            "y": took,
            "text": [one.robot_id for one in latencies],
        }
        for kind, took in kinds.items()
        if any(one is not None for one in took)
    ]
    return figure_of(traces, ("time", "took"), {"yaxis": {"rangemode": "tozero"}})


def figure_of(
    traces: Sequence[Trace], axes: tuple[str, str], layout: Mapping[str, object]
) -> bytes:
    """A figure as JSON; ``axes`` say what they show.

    Checked by the package: a wrong name or value raises here, not in a browser.
    """
    # Half of its users never open a chart, and the package is slow to load.
    from plotly.graph_objects import Figure

    figure = Figure(data=list(traces), layout=dict(layout))
    figure.update_layout(template="none", meta={"x": axes[0], "y": axes[1]})
    if axes[0] == "time":
        figure.update_xaxes(type="date")
    return str(figure.to_json()).encode()


def milliseconds(moment: float) -> float:
    """A moment (Unix s) as the browser counts it."""
    return round(1000.0 * moment, 1)


_STEPS: Final[tuple[Segment, ...]] = ("uplink", "fiware", "iveg", "screen")
_MOST_POINTS: Final = 200


def cdf_figure(sketches: Mapping[Cell, Sketch]) -> bytes:
    """Which share of the messages took no longer than so many ms."""
    layout = {"xaxis": {"type": "log"}, "yaxis": {"range": [0, 1]}}
    return figure_of([*_curves(sketches)], ("ms", "share"), layout)


def _curves(sketches: Mapping[Cell, Sketch]) -> Iterator[Mapping[str, object]]:
    for data, hop in ((data, hop) for data in DATA for hop in _STEPS):
        edges, shares = sketches[data, hop].distribution()
        if not edges:
            continue
        every = max(1, len(edges) // _MOST_POINTS)
        kept = [*range(0, len(edges) - 1, every), len(edges) - 1]
        yield {
            "type": "scatter",
            "mode": "lines",
            "name": f"{data} {hop}",
            "meta": {"hop": hop, "data": data},
            "x": [round(max(0.01, 1000.0 * edges[place]), 3) for place in kept],
            "y": [round(shares[place], 4) for place in kept],
            "line": {"shape": "hv"},
        }


_BUNDLE = "plotly-basic.min.js"
_STYLE_ID = re.compile(rb'getElementById\("([0-9a-f]{64})"\)')


@dataclass(frozen=True, slots=True)
class Library:
    """Plotly for the browser.

    Attributes:
        name: Changes with the content, so that a browser may keep it for good.
        packed: The script, gzipped.
        style_ids: Style elements that it makes unless one of that id is there; a page
            whose policy refuses them has to put something in their place first.
    """

    name: str
    packed: bytes
    style_ids: tuple[str, ...] = ()


@cache
def library() -> Library:
    """The script beside the page; the first call takes a while."""
    data = importlib.resources.files("iveg") / "static" / "vendor" / _BUNDLE
    script = data.read_bytes()
    digest = hashlib.sha256(script).hexdigest()[:16]
    # The sheets that parts of the library bring along are named by their hash.
    hashes = sorted({found.decode() for found in _STYLE_ID.findall(script)})
    packed = gzip.compress(script, 6, mtime=0)
    style_ids = ("plotly.js-style-global", *hashes)
    return Library(f"plotly-{digest}.min.js", packed, style_ids)


def library_facts() -> dict[str, Any]:
    """Address of the script that draws figures, and what a strict page must hold."""
    found = library()
    return {"library": f"/vendor/{found.name}", "style_ids": list(found.style_ids)}


_SILENCE_S = 5.0
_AIR_SILENCE_S = 300.0
_LEAST_ROOM = {"temperature": 4.0, "humidity": 20.0, "co2": 100.0}


def speed_figure(series: Sequence[SpeedSeries], fleet: FleetDescription) -> bytes:
    """Speed (m/s) with the speed limit as a step line, a strip for each robot, as JSON.

    The limit is the factor times the robot's greatest speed; while it is lower the
    strip is shaded.  Lines break where no data came for 5 s: a line through silence
    would be invented.
    """
    traces: list[Trace] = []
    layout: dict[str, object] = {}
    shapes: list[Trace] = []
    for n, one in enumerate(series):
        number = str(n + 1) if n else ""
        traces += [
            {**trace, "yaxis": f"y{number}"} for trace in _speed_traces(one, fleet)
        ]
        layout[f"yaxis{number}"] = {
            "rangemode": "tozero",
            "domain": _strip(n, len(series)),
            "title": {"text": f"{one.robot_id} (m/s)"},
        }
        layout["xaxis"] = {"anchor": f"y{number}"}
        shapes += _slow_downs(one, f"y{number}")
    return figure_of(traces, ("time", "speed"), {**layout, "shapes": shapes})


def _strip(n: int, of: int) -> list[float]:
    """Position of the n-th strip, from the top down (0–1)."""
    top = 1.0 - n / of
    return [round(top - (0.86 if of > 1 else 1.0) / of, 4), round(top, 4)]


def _slow_downs(series: SpeedSeries, axis: str) -> Iterator[Trace]:
    """A shade for each time with a speed limit below full speed."""
    since: float | None = None
    for at, factor in zip(series.at, series.limit, strict=True):
        if factor < FULL_SPEED and since is None:
            since = at
        elif factor >= FULL_SPEED and since is not None:
            yield _shade(since, at, axis)
            since = None
    if since is not None:
        yield _shade(since, series.at[-1], axis)


def _shade(since: float, until: float, axis: str) -> Trace:
    return {
        "type": "rect",
        "name": "slow",
        "layer": "below",
        "x0": milliseconds(since),
        "x1": milliseconds(until),
        "yref": f"{axis} domain",
        "y0": 0,
        "y1": 1,
    }


def margin_figure(series: Sequence[SpeedSeries]) -> bytes:
    """Least margin of each robot (m), as JSON; a gap where it was not known."""
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": one.robot_id,
            "meta": {"kind": "margin", "robot": one.robot_id, "slice_s": one.slice_s},
            "x": [milliseconds(at) for at, _ in points],
            "y": [margin for _, margin in points],
            "connectgaps": False,
        }
        for one in series
        if (points := [*_lasting(one)])
    ]
    return figure_of(traces, ("time", "margin"), {})


def _lasting(series: SpeedSeries) -> Iterator[tuple[float, float | None]]:
    """Each known margin; the last before a gap for as long as it stands for.

    A lone one would have no line.
    """
    lasts_s = max(ODOMETRY_PERIOD_S, series.slice_s)
    rows = zip(series.at, series.margin, strict=True)
    for (at, margin), (then, after) in pairwise([*rows, (float("inf"), None)]):
        if margin is None:
            continue
        yield at, margin
        if after is None or then - at > 3 * lasts_s:
            yield min(at + lasts_s, then), margin
            yield min(at + lasts_s, then), None


def climate_figures(series: ClimateSeries) -> dict[str, bytes]:
    """Temperature (°C), relative humidity (%) and CO₂ (ppm) over time, as JSON.

    A figure is empty where its sensor was silent all along; lines break where nothing
    was heard for five minutes.
    """
    humidity = [None if h is None else 100.0 * h for h in series.relative_humidity]
    values: dict[str, Sequence[float | None]] = {
        "temperature": series.temperature,
        "humidity": humidity,
        "co2": series.co2,
    }
    return {kind: _climate_figure(series, kind, y) for kind, y in values.items()}


def _speed_traces(series: SpeedSeries, fleet: FleetDescription) -> Iterator[Trace]:
    robot = series.robot_id
    fastest = fleet.of_robot(robot).profile.max_speed
    at = [milliseconds(moment) for moment in series.at]
    lines: tuple[tuple[str, Sequence[float | None], Trace], ...] = (
        ("speed", [round(v, 3) for v in series.linear], {}),
        ("mandated", [fastest * f for f in series.limit], {"shape": "hv"}),
    )
    gaps = _gaps(series.at, max(_SILENCE_S, 3 * series.slice_s))
    for kind, values, line in lines:
        yield {
            "type": "scatter",
            "mode": "lines",
            "name": f"{robot} {kind}",
            "meta": {"kind": kind, "robot": robot, "slice_s": series.slice_s},
            "x": _broken(at, gaps, at),
            "y": _broken(values, gaps, [None] * len(at)),
            "line": line,
            "connectgaps": False,
        }


def _climate_figure(
    series: ClimateSeries, kind: str, values: Sequence[float | None]
) -> bytes:
    heard = [value for value in values if value is not None]
    traces = [_readings(series, kind, kind, values)] if heard else []
    layout = {"showlegend": False, "yaxis": {"range": _room(heard, _LEAST_ROOM[kind])}}
    return figure_of(traces, ("time", kind), layout)


def measurement_figure(series: MeasurementSeries) -> bytes:
    """One attribute of other equipment over time, as JSON."""
    trace = _readings(series, "value", "measurement", series.value)
    return figure_of([trace], ("time", "measurement"), {"showlegend": False})


def _readings(
    series: ClimateSeries | MeasurementSeries,
    name: str,
    kind: str,
    values: Sequence[float | None],
) -> Trace:
    """A line with its points, broken where nothing was heard for long."""
    at = [milliseconds(moment) for moment in series.at]
    gaps = _gaps(series.at, max(_AIR_SILENCE_S, 3 * series.slice_s))
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "name": name,
        "meta": {"kind": kind, "slice_s": series.slice_s},
        "marker": {"size": 4},
        "x": _broken(at, gaps, at),
        "y": _broken(values, gaps, [None] * len(at)),
        "connectgaps": False,
    }


def _room(values: Sequence[float], least: float) -> list[float] | None:
    """A range that keeps a sensor's noise from looking like weather; None: automatic.

    Args:
        values: What is drawn.
        least: The axis covers at least as much.
    """
    low, high = min(values, default=0.0), max(values, default=0.0)
    if not values or high - low >= least:
        return None
    middle = (low + high) / 2
    return [middle - least / 2, middle + least / 2]


def _gaps(at: Sequence[float], longest: float) -> list[int]:
    """Places after which no data came for too long."""
    pairs = enumerate(pairwise(at))
    return [place for place, (one, other) in pairs if other - one > longest]


def _broken(
    values: Sequence[float | None], gaps: Sequence[int], fill: Sequence[float | None]
) -> list[float | None]:
    out: list[float | None] = []
    start = 0
    for gap in gaps:
        out += [*values[start : gap + 1], fill[gap]]
        start = gap + 1
    return out + list(values[start:])
