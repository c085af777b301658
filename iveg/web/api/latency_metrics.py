"""Metrics of each hop's latency, its loss and the robots' clocks."""

from collections.abc import Iterator
from typing import Final

from iveg.domain.latency.segments import SEGMENTS, Data, Segment
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.watch import LatencyWatch
from iveg.web.api.prometheus import family, labels_of, number

_SHARES: Final = (0.5, 0.95, 0.99)
Parts = list[tuple[str, Data, Segment, int, float, list[Sketch]]]


def parts_of(watch: LatencyWatch) -> Parts:
    """Of each series its totals and last minute; read in the loop."""
    return [
        (one.robot_id, one.data, hop, series.count, series.total, series.parts("1min"))
        for one in watch.streams
        for hop, series in one.segments.items()
        if series.count
    ]


def latency_of(parts: Parts) -> Iterator[str]:
    """Quantiles, sum and count of each hop."""
    quantiles: list[tuple[str, float | None]] = []
    counts: list[tuple[str, float | None]] = []
    sums: list[tuple[str, float | None]] = []
    for robot, data, hop, count, total, sketches in parts:
        sketch = merged(sketches)
        of = {"robot": robot, "data": data, "hop": hop}
        quantiles += [
            (labels_of(**of, quantile=f"{share:g}"), sketch.quantile(share))
            for share in _SHARES
        ]
        counts.append((labels_of(**of), count))
        sums.append((labels_of(**of), total))
    yield from family(
        "latency_seconds",
        "summary",
        "Latency of a hop; quantiles are of the last minute.",
        quantiles,
    )
    # Of one family in the text format: no header of their own.
    for name, samples in (("sum", sums), ("count", counts)):
        yield from (
            f"iveg_latency_seconds_{name}{at} {number(value or 0)}"
            for at, value in samples
        )


def streams_of(watch: LatencyWatch) -> Iterator[str]:
    """What passed each hop and what was lost, how often, and how late it is."""
    streams = watch.streams
    orders = [
        (labels_of(robot=one.robot_id, data=one.data, hop=hop), order)
        for one in streams
        for hop, order in (("uplink", one.up), ("fiware", one.fiware))
    ]
    for name, text in (
        ("passed", "Messages that passed the hop."),
        ("missing", "Messages that were lost at the hop."),
        ("reordered", "Messages that arrived after a later one."),
        ("repeated", "Messages that arrived twice."),
    ):
        samples = ((labels, getattr(order, name)) for labels, order in orders)
        yield from family(f"messages_{name}_total", "counter", text, samples)
    excluded = (
        (labels_of(robot=one.robot_id, data=one.data, hop=hop, reason=why), count)
        for one in streams
        for (hop, why), count in one.excluded.items()
    )
    yield from family(
        "messages_excluded_total",
        "counter",
        "Messages without a usable latency, by reason.",
        excluded,
    )
    rates = (
        (labels_of(robot=one.robot_id, data=one.data, way=way), getattr(one.rates, way))
        for one in streams
        for way in ("heard", "agent", "orion")
    )
    yield from family("rate_hertz", "gauge", "Measured rate of messages.", rates)
    lags = (
        (labels_of(hop=hop, robot=robot), lag)
        for (hop, robot), lag in watch.overloads.lags.items()
        if hop in SEGMENTS
    )
    yield from family(
        "behind_seconds", "gauge", "Delay of the newest messages at the hop.", lags
    )


def clocks_of(watch: LatencyWatch) -> Iterator[str]:
    """How far robots' clocks are off."""
    clocks = [(labels_of(robot=name), one) for name, one in watch.clocks.items()]
    offsets = ((labels, one.offset_s) for labels, one in clocks)
    yield from family(
        "clock_offset_seconds",
        "gauge",
        "Clock of the robot minus clock of the server.",
        offsets,
    )
    within = ((labels, one.uncertainty_s) for labels, one in clocks)
    yield from family(
        "clock_uncertainty_seconds", "gauge", "Greatest error of that offset.", within
    )
