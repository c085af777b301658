"""Metrics for Prometheus: counters, hops, latency, loss, queues, safety tiles.

``deploy/grafana`` draws them, and a test compares its names with these.
"""

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from fastapi import APIRouter, Depends
from starlette.responses import PlainTextResponse, Response

from iveg.domain.latency.segments import SEGMENTS, Data, Segment
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Instant
from iveg.models.health import Health, HopHealth, Safety
from iveg.web.security.authentication import require

_SHARES: Final = (0.5, 0.95, 0.99)
_Parts = list[tuple[str, Data, Segment, int, float, list[Sketch]]]


@dataclass(frozen=True, slots=True)
class Queues:
    """Depth of queues, drops and retries.

    Attributes:
        depths: Queue → number of waiting items.
        dropped: Queue → items dropped since the start.
        retries: Operation → retries since the start.
    """

    depths: Mapping[str, int]
    dropped: Mapping[str, int]
    retries: Mapping[str, int]


def router(
    clock: Callable[[], Instant],
    health: Callable[[Instant], Health],
    watch: LatencyWatch,
    queues: Callable[[], Queues],
) -> APIRouter:
    """The endpoint that Prometheus asks."""
    routes = APIRouter(tags=["health"])

    @routes.get("/metrics", dependencies=[Depends(require("read"))])
    async def metrics() -> Response:
        """Counters, hops, latency and safety in Prometheus' text format."""
        state = health(clock())
        parts = _parts(watch)
        lines = [
            *_events(state.counters),
            *_hops(state.hops),
            *_streams(watch),
            *_clocks(watch),
            *_queues(queues()),
            *_safety(state.safety),
        ]
        # Twenty robots have 300 sketches to sum up: beside the loop, not in it.
        lines += await asyncio.to_thread(lambda: list(_latency(parts)))
        return PlainTextResponse("\n".join(lines) + "\n")

    return routes


def _family(
    name: str, kind: str, told: str, samples: Iterable[tuple[str, float | None]]
) -> Iterator[str]:
    """One family; samples that nobody knows are left out."""
    yield f"# HELP iveg_{name} {told}"
    yield f"# TYPE iveg_{name} {kind}"
    for labels, value in samples:
        if value is not None:
            yield f"iveg_{name}{labels} {_number(value)}"


def _number(value: float) -> str:
    return str(int(value) if isinstance(value, bool) else value)


def _labels(**values: str) -> str:
    return "{" + ",".join(f'{name}="{value}"' for name, value in values.items()) + "}"


def _events(counters: Mapping[str, int]) -> Iterator[str]:
    samples = ((_labels(name=name), count) for name, count in counters.items())
    yield from _family("events_total", "counter", "Everything counted.", samples)


def _hops(hops: Iterable[HopHealth]) -> Iterator[str]:
    known = [(_labels(hop=hop.hop), hop) for hop in hops]
    up = ((labels, hop.state == "ok") for labels, hop in known)
    yield from _family("hop_up", "gauge", "Whether a hop is well.", up)
    lag = ((labels, hop.lag_s) for labels, hop in known)
    yield from _family("lag_seconds", "gauge", "How late a probe passes it.", lag)
    growing = (
        (labels, None if hop.lag_s is None else hop.growing) for labels, hop in known
    )
    yield from _family("lag_growing", "gauge", "Whether that grows.", growing)


def _parts(watch: LatencyWatch) -> _Parts:
    """Of each series its totals and last minute; read in the loop."""
    return [
        (one.robot_id, one.data, hop, series.count, series.total, series.parts("1min"))
        for one in watch.streams
        for hop, series in one.segments.items()
        if series.count
    ]


def _latency(parts: _Parts) -> Iterator[str]:
    quantiles: list[tuple[str, float | None]] = []
    counts: list[tuple[str, float | None]] = []
    sums: list[tuple[str, float | None]] = []
    for robot, data, hop, count, total, sketches in parts:
        sketch = merged(sketches)
        for share in _SHARES:
            labels = _labels(robot=robot, data=data, hop=hop, quantile=f"{share:g}")
            quantiles.append((labels, sketch.quantile(share)))
        labels = _labels(robot=robot, data=data, hop=hop)
        counts.append((labels, count))
        sums.append((labels, total))
    told = "What a hop took; quantiles of the last minute."
    yield from _family("latency_seconds", "summary", told, quantiles)
    # Of one family in the text format: no header of their own.
    for name, samples in (("sum", sums), ("count", counts)):
        yield from (
            f"iveg_latency_seconds_{name}{at} {_number(value or 0)}"
            for at, value in samples
        )


def _streams(watch: LatencyWatch) -> Iterator[str]:
    streams = watch.streams
    orders = [
        (_labels(robot=one.robot_id, data=one.data, hop=hop), order)
        for one in streams
        for hop, order in (("uplink", one.up), ("fiware", one.fiware))
    ]
    for name, told in (
        ("passed", "Messages that passed a hop."),
        ("missing", "Messages that never came out of a hop."),
        ("reordered", "Messages that a later one overtook."),
        ("repeated", "Messages that came twice."),
    ):
        samples = ((labels, getattr(order, name)) for labels, order in orders)
        yield from _family(f"messages_{name}_total", "counter", told, samples)
    excluded = (
        (_labels(robot=one.robot_id, data=one.data, hop=hop, reason=why), count)
        for one in streams
        for (hop, why), count in one.excluded.items()
    )
    told = "Messages that are in no statistics."
    yield from _family("messages_excluded_total", "counter", told, excluded)
    rates = (
        (_labels(robot=one.robot_id, data=one.data, way=way), getattr(one.rates, way))
        for one in streams
        for way in ("heard", "agent", "orion")
    )
    yield from _family("rate_hertz", "gauge", "Messages a second, really.", rates)
    lags = (
        (_labels(hop=hop, robot=robot), lag)
        for (hop, robot), lag in watch.overloads.lags.items()
        if hop in SEGMENTS
    )
    yield from _family("behind_seconds", "gauge", "How far a hop is behind.", lags)


def _clocks(watch: LatencyWatch) -> Iterator[str]:
    clocks = [(_labels(robot=name), one) for name, one in watch.clocks.items()]
    offsets = ((labels, one.offset_s) for labels, one in clocks)
    told = "Robot's clock less ours."
    yield from _family("clock_offset_seconds", "gauge", told, offsets)
    within = ((labels, one.uncertainty_s) for labels, one in clocks)
    told = "How wrong that may be."
    yield from _family("clock_uncertainty_seconds", "gauge", told, within)


def _queues(queues: Queues) -> Iterator[str]:
    depths = ((_labels(queue=name), n) for name, n in queues.depths.items())
    yield from _family("queue_depth", "gauge", "What waits.", depths)
    dropped = ((_labels(queue=name), n) for name, n in queues.dropped.items())
    yield from _family("dropped_total", "counter", "What gave way.", dropped)
    retries = ((_labels(what=name), n) for name, n in queues.retries.items())
    yield from _family("retries_total", "counter", "What was done again.", retries)


def _safety(safety: Safety) -> Iterator[str]:
    latency, asked = safety.alert_latency, safety.not_echoed
    quantiles: list[tuple[str, float | None]] = [
        (_labels(quantile="0.5"), _seconds(latency.p50_ms)),
        (_labels(quantile="0.95"), _seconds(latency.p95_ms)),
        (_labels(quantile="0.99"), _seconds(latency.p99_ms)),
    ]
    told = "Look at a person to the robot's own report, last five minutes."
    yield from _family("alert_latency_seconds", "gauge", told, quantiles)
    told = "Alerts not answered within a second, last five minutes."
    yield from _family("alerts_not_echoed", "gauge", told, [("", asked.count)])
    told = "Alerts that should have been answered."
    yield from _family("alerts_asked", "gauge", told, [("", asked.of)])
    margin = safety.negative_margin
    told = "Share of today's known time with a margin below zero."
    yield from _family("negative_margin_ratio", "gauge", told, [("", margin.share)])
    told = "Today's time in which margins were known."
    known = [("", margin.known_s)]
    yield from _family("margin_known_seconds", "gauge", told, known)
    worst = safety.worst_margin.margin
    told = "Least margin of today."
    least = None if worst is None else worst.margin_m
    yield from _family("worst_margin_metres", "gauge", told, [("", least)])


def _seconds(ms: float | None) -> float | None:
    return None if ms is None else ms / 1000.0
