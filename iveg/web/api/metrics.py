"""Metrics for Prometheus: counters, hops, latency, loss, queues, safety tiles.

``deploy/grafana`` draws them, and a test compares its names with these.
"""

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from fastapi import APIRouter, Depends, Response
from fastapi.responses import PlainTextResponse

from iveg.domain.latency.segments import SEGMENTS, Data, Segment
from iveg.domain.latency.sketch import Sketch, merged
from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Instant
from iveg.models.health import Health, HopHealth, Safety
from iveg.pipeline.ports import Clock
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
    clock: Clock,
    health: Callable[[Instant], Health],
    watch: LatencyWatch,
    queues: Callable[[], Queues],
    longest_turn_s: Callable[[Instant], float],
) -> APIRouter:
    """The endpoint that Prometheus asks."""
    routes = APIRouter(tags=["health"])

    @routes.get(
        "/metrics",
        dependencies=[Depends(require("read"))],
        response_class=PlainTextResponse,
    )
    async def metrics() -> Response:
        """Counters, hops, latency and safety in Prometheus' text format."""
        now = clock()
        state = health(now)
        parts = _parts(watch)
        lines = [
            *_events(state.counters),
            *_hops(state.hops),
            *_streams(watch),
            *_clocks(watch),
            *_queues(queues()),
            *_turns(longest_turn_s(now)),
            *_safety(state.safety),
            *_protection(state.counters),
        ]
        # Twenty robots have 300 sketches to sum up: beside the loop, not in it.
        lines += await asyncio.to_thread(lambda: list(_latency(parts)))
        return PlainTextResponse("\n".join(lines) + "\n")

    return routes


def _family(
    name: str, kind: str, text: str, samples: Iterable[tuple[str, float | None]]
) -> Iterator[str]:
    """One family; samples that nobody knows are left out."""
    yield f"# HELP iveg_{name} {text}"
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
    yield from _family(
        "events_total", "counter", "Events since the start, by name.", samples
    )


def _hops(hops: Iterable[HopHealth]) -> Iterator[str]:
    known = [(_labels(hop=hop.hop), hop) for hop in hops]
    up = ((labels, hop.state == "ok") for labels, hop in known)
    yield from _family("hop_up", "gauge", "1 while the hop works, else 0.", up)
    lag = ((labels, hop.lag_s) for labels, hop in known)
    yield from _family(
        "lag_seconds", "gauge", "Lag of the heartbeat probe at the hop.", lag
    )
    growing = (
        (labels, None if hop.lag_s is None else hop.growing) for labels, hop in known
    )
    yield from _family(
        "lag_growing", "gauge", "1 while that lag grows, else 0.", growing
    )


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
        of = {"robot": robot, "data": data, "hop": hop}
        quantiles += [
            (_labels(**of, quantile=f"{share:g}"), sketch.quantile(share))
            for share in _SHARES
        ]
        counts.append((_labels(**of), count))
        sums.append((_labels(**of), total))
    yield from _family(
        "latency_seconds",
        "summary",
        "Latency of a hop; quantiles are of the last minute.",
        quantiles,
    )
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
    for name, text in (
        ("passed", "Messages that passed the hop."),
        ("missing", "Messages that were lost at the hop."),
        ("reordered", "Messages that arrived after a later one."),
        ("repeated", "Messages that arrived twice."),
    ):
        samples = ((labels, getattr(order, name)) for labels, order in orders)
        yield from _family(f"messages_{name}_total", "counter", text, samples)
    excluded = (
        (_labels(robot=one.robot_id, data=one.data, hop=hop, reason=why), count)
        for one in streams
        for (hop, why), count in one.excluded.items()
    )
    yield from _family(
        "messages_excluded_total",
        "counter",
        "Messages without a usable latency, by reason.",
        excluded,
    )
    rates = (
        (_labels(robot=one.robot_id, data=one.data, way=way), getattr(one.rates, way))
        for one in streams
        for way in ("heard", "agent", "orion")
    )
    yield from _family("rate_hertz", "gauge", "Measured rate of messages.", rates)
    lags = (
        (_labels(hop=hop, robot=robot), lag)
        for (hop, robot), lag in watch.overloads.lags.items()
        if hop in SEGMENTS
    )
    yield from _family(
        "behind_seconds", "gauge", "Delay of the newest messages at the hop.", lags
    )


def _clocks(watch: LatencyWatch) -> Iterator[str]:
    clocks = [(_labels(robot=name), one) for name, one in watch.clocks.items()]
    offsets = ((labels, one.offset_s) for labels, one in clocks)
    yield from _family(
        "clock_offset_seconds",
        "gauge",
        "Clock of the robot minus clock of the server.",
        offsets,
    )
    within = ((labels, one.uncertainty_s) for labels, one in clocks)
    yield from _family(
        "clock_uncertainty_seconds", "gauge", "Greatest error of that offset.", within
    )


def _queues(queues: Queues) -> Iterator[str]:
    for name, kind, text, label, counts in (
        ("queue_depth", "gauge", "Items in the queue.", "queue", queues.depths),
        (
            "dropped_total",
            "counter",
            "Items that a full queue dropped.",
            "queue",
            queues.dropped,
        ),
        ("retries_total", "counter", "Repeated operations.", "what", queues.retries),
    ):
        samples = ((_labels(**{label: key}), count) for key, count in counts.items())
        yield from _family(name, kind, text, samples)


def _turns(longest_s: float) -> Iterator[str]:
    yield from _family(
        "loop_longest_turn_seconds",
        "gauge",
        "CPU time of the longest turn of the loop in the last two minutes.",
        [("", round(longest_s, 4))],
    )


def _safety(safety: Safety) -> Iterator[str]:
    latency = safety.alert_latency
    asked, margin = safety.not_echoed, safety.negative_margin
    worst = safety.worst_margin.margin
    yield from _family(
        "alert_latency_seconds",
        "gauge",
        "Time from a detection of a person to the robot's report, last five minutes.",
        [
            (_labels(quantile="0.5"), _seconds(latency.p50_ms)),
            (_labels(quantile="0.95"), _seconds(latency.p95_ms)),
            (_labels(quantile="0.99"), _seconds(latency.p99_ms)),
        ],
    )
    for name, text, value in (
        (
            "alerts_not_echoed",
            "Alerts without an answer within one second, last five minutes.",
            asked.count,
        ),
        (
            "alerts_asked",
            "Alerts that required an answer, last five minutes.",
            asked.of,
        ),
        (
            "negative_margin_ratio",
            "Share of today's time with known margins in which one was negative.",
            margin.share,
        ),
        (
            "margin_known_seconds",
            "Time of today with known margins.",
            margin.known_s,
        ),
        (
            "worst_margin_metres",
            "Smallest margin of today.",
            None if worst is None else worst.margin_m,
        ),
    ):
        yield from _family(name, "gauge", text, [("", value)])


def _protection(counters: Mapping[str, int]) -> Iterator[str]:
    slow_s, fast_s = (counters.get(f"near_s.{how}", 0) for how in ("slow", "fast"))
    near_s = slow_s + fast_s
    yield from _family(
        "protection_ratio",
        "gauge",
        "Share of the time near a person in sight that robots drove slowly.",
        [("", slow_s / near_s if near_s else None)],
    )


def _seconds(ms: float | None) -> float | None:
    return None if ms is None else ms / 1000.0
