"""Plotly figures of rows; the only importer of plotly.

The package checks every figure as it is made.  The browser draws it with the basic
bundle of the same version, which lies beside the page (docs/decisions, "What each
dependency is for").  ``meta`` names the quantity of a line or an axis; the page has
its words in the reader's language.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from iveg.adapters.history.series import Series
from iveg.domain.feedback import FULL_SPEED
from iveg.domain.fleet import FleetDescription, as_counted
from iveg.domain.latency import DATA, Cell, Segment, Sketch

Trace = Mapping[str, object]
Values = Sequence[float | None]
Lines = Mapping[tuple[str, ...], Series]

_SILENCE_S = 5.0
_AIR_SILENCE_S = 300.0
_STEPS: Final[tuple[Segment, ...]] = ("uplink", "fiware", "iveg", "screen")
_MOST_POINTS: Final = 200


# --- figures ----------------------------------------------------------------------


def figure_of(
    traces: Sequence[Trace], axes: tuple[str, str], layout: Mapping[str, object]
) -> bytes:
    """A figure as JSON; ``axes`` names the quantities on x and y.

    Checked by the package: a wrong name or value raises here, not in a browser.
    """
    # Half of all users never open a chart, and the package is slow to load.
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


# --- latencies ---------------------------------------------------------


def cdf_figure(sketches: Mapping[Cell, Sketch]) -> bytes:
    """Distribution of latencies: share of the messages within a time (ms)."""
    layout = {"xaxis": {"type": "log"}, "yaxis": {"range": [0, 1]}}
    curves = []
    for data, hop in product(DATA, _STEPS):
        edges, shares = sketches[data, hop].distribution()
        if edges:
            # A line of thousands of steps would look the same; the last stays, at 1.
            every = max(1, len(edges) // _MOST_POINTS)
            indices = [*range(0, len(edges) - 1, every), len(edges) - 1]
            # A logarithmic axis has no zero.
            x = [round(max(0.01, 1000.0 * edges[place]), 3) for place in indices]
            y = [round(shares[place], 4) for place in indices]
            meta = {"hop": hop, "data": data}
            curves.append(_line(f"{data} {hop}", x, y, meta, line={"shape": "hv"}))
    return figure_of(curves, ("ms", "share"), layout)


# --- over time --------------------------------------------------------------------


def history_figures(speeds: Lines, fleet: FleetDescription) -> dict[str, bytes]:
    """The figures of a range by name, one of speed for each robot: R2 before R10."""
    robots = sorted((robot for (robot,) in speeds), key=as_counted)
    return {
        f"speed/{robot}": speed_figure(robot, speeds[robot,], fleet) for robot in robots
    }


def speed_figure(robot: str, series: Series, fleet: FleetDescription) -> bytes:
    """Speed of a robot (m/s) with its speed limit as a step line, as JSON.

    The limit is the factor times the robot's greatest speed; while it is lower the
    figure is shaded.  Lines break where no data came for 5 s: a line through silence
    would be false.
    """
    fastest = fleet.of_robot(robot).profile.max_speed
    factors = np.array(series.values["limit_factor"], float)
    lines = {
        "speed": (np.array(series.values["linear"], float).round(3).tolist(), {}),
        "mandated": ((fastest * factors).tolist(), {"shape": "hv"}),
    }
    layout = {
        "showlegend": False,
        "yaxis": {"rangemode": "tozero", "title": {"text": f"{robot} (m/s)"}},
        "shapes": [*_slow_downs(series.at, factors < FULL_SPEED)],
    }
    traces = [
        _series_line(
            series, values, _SILENCE_S, {"kind": kind, "robot": robot}, line=line
        )
        for kind, (values, line) in lines.items()
    ]
    return figure_of(traces, ("time", "speed"), layout)


def _slow_downs(at: Sequence[float], is_slow: NDArray[np.bool_]) -> Iterator[Trace]:
    """A shade for each time with a speed limit below full speed."""
    # Ends count as full speed, so begins and ends of shades come in pairs.
    turns = np.flatnonzero(np.diff(is_slow, prepend=False, append=False)).tolist()
    times = _times([*at, *at[-1:]])
    for since, until in zip(turns[::2], turns[1::2], strict=True):
        yield {
            "type": "rect",
            "name": "slow",
            "layer": "below",
            "x0": times[since],
            "x1": times[until],
            "yref": "y domain",
            "y0": 0,
            "y1": 1,
        }


def climate_figures(lines: Lines) -> dict[str, bytes]:
    """Temperature (°C), relative humidity (%) and CO₂ (ppm) over time, as JSON.

    A figure is empty without any value of its sensor; lines break where no row came for
    five minutes.
    """
    air = lines.get((), Series((), {}))
    humidity = air.values.get("relative_humidity", ())
    figures = {
        "temperature": air.values.get("temperature", ()),
        "humidity": [None if share is None else 100.0 * share for share in humidity],
        "co2": air.values.get("co2", ()),
    }
    return {kind: _air_figure(air, kind, values) for kind, values in figures.items()}


def equipment_figures(lines: Lines) -> dict[str, bytes]:
    """Each attribute of other equipment over time, as JSON, by entity and attribute."""
    return {
        "/".join(key): _air_figure(series, "measurement", series.values["value"])
        for key, series in lines.items()
    }


def _air_figure(series: Series, kind: str, values: Values) -> bytes:
    """A line with its points, broken where no row came for five minutes."""
    has_values = any(value is not None for value in values)
    look = {"mode": "lines+markers", "marker": {"size": 4}}
    line = _series_line(series, values, _AIR_SILENCE_S, {"kind": kind}, **look)
    traces = [line] if has_values else []
    return figure_of(traces, ("time", kind), {"showlegend": False})


def _series_line(
    series: Series, values: Values, silence_s: float, meta: Trace, **more: object
) -> Trace:
    """A line that breaks after this time without a row (s)."""
    # Means over slices come a slice apart, which is no silence.
    longest_s = max(silence_s, 3 * series.slice_s)
    gaps = np.flatnonzero(np.diff(series.at) > longest_s) + 1
    times = np.array(_times(series.at))
    x = np.insert(times, gaps, times[gaps - 1]).tolist()
    y = np.insert(np.array(values, float), gaps, np.nan).tolist()
    name = f"{meta.get('robot', '')} {meta['kind']}".strip()
    return _line(name, x, y, {**meta, "slice_s": series.slice_s}, **more)
