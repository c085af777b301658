"""Figures over time: speed, margin, air and other equipment."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from iveg.adapters.history.series import ClimateSeries, MeasurementSeries, SpeedSeries
from iveg.domain.feedback import FULL_SPEED
from iveg.domain.fleet import FleetDescription
from iveg.pipeline.record import ODOMETRY_PERIOD_S
from iveg.web.pages.charts import Trace, figure_of, milliseconds

_SILENCE_S = 5.0
_AIR_SILENCE_S = 300.0
_LEAST_ROOM = {"temperature": 4.0, "humidity": 20.0, "co2": 100.0}


def speed_figure(series: Sequence[SpeedSeries], fleet: FleetDescription) -> bytes:
    """Speed (m/s) with the speed limit as a step line, a strip for each robot, as JSON.

    The limit is the factor times the robot's greatest speed; while it is lower the
    strip is shaded.  Lines break where no data came for 5 s: a line through silence
    would be invented.  What a robot sent after a gap has a mark at each point.
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
    late = [n for n, was_late in enumerate(series.late) if was_late]
    if late:
        yield {
            "type": "scatter",
            "mode": "markers",
            "name": f"{robot} late",
            "meta": {"kind": "late", "robot": robot, "slice_s": series.slice_s},
            "x": [at[n] for n in late],
            "y": [round(series.linear[n], 3) for n in late],
            "marker": {"size": 6},
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
