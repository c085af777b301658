"""Rows become Plotly figures; the only importer of plotly.

The package checks every figure as it is made.  The browser draws it with the basic
bundle of the same version, which lies beside the page (docs/decisions, "What each
dependency is for").  ``meta`` names what a trace or an axis shows, and the page puts
the words in the reader's language.
"""

import gzip
import hashlib
import importlib.resources
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise, product
from typing import Any, Final

import numpy as np

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
Values = Sequence[float | None]

_BIN = 1.0 / CONFIDENCE_BINS
_SILENCE_S = 5.0
_AIR_SILENCE_S = 300.0
_LEAST_ROOM = {"temperature": 4.0, "humidity": 20.0, "co2": 100.0}
_STEPS: Final[tuple[Segment, ...]] = ("uplink", "fiware", "iveg", "screen")
_MOST_POINTS: Final = 200
_BUNDLE = "plotly-basic.min.js"
_STYLE_ID = re.compile(rb'getElementById\("([0-9a-f]{64})"\)')


# --- figures ----------------------------------------------------------------------


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


def _line(name: str, x: Values, y: Values, meta: Trace, **more: object) -> Trace:
    """A line that breaks where a value is None."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "meta": meta,
        "x": x,
        "y": y,
        "connectgaps": False,
        **more,
    }


def _times(moments: Iterable[float]) -> list[float]:
    """Moments (Unix s) as the browser counts them (ms)."""
    return [round(1000.0 * moment, 1) for moment in moments]


def _broken(
    at: Sequence[float], longest: float, values: Values
) -> tuple[Values, Values]:
    """Times and values of a line, with a gap where no data came for so long (s)."""
    gaps = np.flatnonzero(np.diff(at) > longest) + 1
    times = np.array(_times(at))
    x = np.insert(times, gaps, times[gaps - 1]).tolist()
    return x, np.insert(np.array(values, float), gaps, np.nan).tolist()


# --- counts and latencies ---------------------------------------------------------


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
        ends = {"x0": threshold, "x1": threshold, "y0": 0, "y1": 1}
        line = {"type": "line", "name": "threshold", "yref": "paper", **ends}
        layout["shapes"] = [line]
    return figure_of(traces, ("confidence", "count"), layout)


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
            "x": _times(one.requested_at for one in latencies),
            "y": took,
            "text": [one.robot_id for one in latencies],
        }
        for kind, took in kinds.items()
        if any(one is not None for one in took)
    ]
    return figure_of(traces, ("time", "took"), {"yaxis": {"rangemode": "tozero"}})


def cdf_figure(sketches: Mapping[Cell, Sketch]) -> bytes:
    """Which share of the messages took no longer than so many ms."""
    layout = {"xaxis": {"type": "log"}, "yaxis": {"range": [0, 1]}}
    curves = []
    for data, hop in product(DATA, _STEPS):
        edges, shares = sketches[data, hop].distribution()
        if edges:
            every = max(1, len(edges) // _MOST_POINTS)
            kept = [*range(0, len(edges) - 1, every), len(edges) - 1]
            x = [round(max(0.01, 1000.0 * edges[place]), 3) for place in kept]
            y = [round(shares[place], 4) for place in kept]
            meta = {"hop": hop, "data": data}
            curves.append(_line(f"{data} {hop}", x, y, meta, line={"shape": "hv"}))
    return figure_of(curves, ("ms", "share"), layout)


# --- plotly's script for the browser ----------------------------------------------


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


# --- over time --------------------------------------------------------------------


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
    slow = np.array(series.limit) < FULL_SPEED
    turns = np.flatnonzero(np.diff(slow, prepend=False, append=False)).tolist()
    times = _times([*series.at, *series.at[-1:]])
    for since, until in zip(turns[::2], turns[1::2], strict=True):
        yield {
            "type": "rect",
            "name": "slow",
            "layer": "below",
            "x0": times[since],
            "x1": times[until],
            "yref": f"{axis} domain",
            "y0": 0,
            "y1": 1,
        }


def margin_figure(series: Sequence[SpeedSeries]) -> bytes:
    """Least margin of each robot (m), as JSON; a gap where it was not known."""
    traces = []
    for one in series:
        points = [*_lasting(one)]
        if points:
            meta = {"kind": "margin", "robot": one.robot_id, "slice_s": one.slice_s}
            x, y = _times(at for at, _ in points), [margin for _, margin in points]
            traces.append(_line(one.robot_id, x, y, meta))
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
    return {
        "temperature": _climate_figure(series, "temperature", series.temperature),
        "humidity": _climate_figure(series, "humidity", humidity),
        "co2": _climate_figure(series, "co2", series.co2),
    }


def _speed_traces(series: SpeedSeries, fleet: FleetDescription) -> Iterator[Trace]:
    robot = series.robot_id
    fastest = fleet.of_robot(robot).profile.max_speed
    lines: tuple[tuple[str, Values, Trace], ...] = (
        ("speed", [round(v, 3) for v in series.linear], {}),
        ("mandated", [fastest * f for f in series.limit], {"shape": "hv"}),
    )
    longest = max(_SILENCE_S, 3 * series.slice_s)
    for kind, values, line in lines:
        x, y = _broken(series.at, longest, values)
        meta = {"kind": kind, "robot": robot, "slice_s": series.slice_s}
        yield _line(f"{robot} {kind}", x, y, meta, line=line)


def _climate_figure(series: ClimateSeries, kind: str, values: Values) -> bytes:
    heard = [value for value in values if value is not None]
    traces = [_readings(series, kind, kind, values)] if heard else []
    layout = {"showlegend": False, "yaxis": {"range": _room(heard, _LEAST_ROOM[kind])}}
    return figure_of(traces, ("time", kind), layout)


def measurement_figure(series: MeasurementSeries) -> bytes:
    """One attribute of other equipment over time, as JSON."""
    trace = _readings(series, "value", "measurement", series.value)
    return figure_of([trace], ("time", "measurement"), {"showlegend": False})


def _readings(
    series: ClimateSeries | MeasurementSeries, name: str, kind: str, values: Values
) -> Trace:
    """A line with its points, broken where nothing was heard for long."""
    x, y = _broken(series.at, max(_AIR_SILENCE_S, 3 * series.slice_s), values)
    meta = {"kind": kind, "slice_s": series.slice_s}
    return _line(name, x, y, meta, mode="lines+markers", marker={"size": 4})


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
