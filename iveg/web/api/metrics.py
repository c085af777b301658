"""Metrics for Prometheus: counters, hops, latency, loss, queues, safety tiles.

``deploy/grafana`` draws them, and a test compares its names with these.
"""

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from fastapi import APIRouter, Depends, Response
from fastapi.responses import PlainTextResponse

from iveg.domain.latency.watch import LatencyWatch
from iveg.domain.observations import Instant
from iveg.models.health import Health, HopHealth
from iveg.models.safety import Safety
from iveg.pipeline.ports import Clock
from iveg.web.api.latency_metrics import clocks_of, latency_of, parts_of, streams_of
from iveg.web.api.prometheus import family, labels_of
from iveg.web.security.requirements import require


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
        parts = parts_of(watch)
        lines = [
            *_events(state.counters),
            *_hops(state.hops),
            *streams_of(watch),
            *clocks_of(watch),
            *_queues(queues()),
            *_turns(longest_turn_s(now)),
            *_safety(state.safety),
            *_protection(state.counters),
        ]
        # Twenty robots have 300 sketches to sum up: beside the loop, not in it.
        lines += await asyncio.to_thread(lambda: list(latency_of(parts)))
        return PlainTextResponse("\n".join(lines) + "\n")

    return routes


def _events(counters: Mapping[str, int]) -> Iterator[str]:
    samples = ((labels_of(name=name), count) for name, count in counters.items())
    yield from family(
        "events_total", "counter", "Events since the start, by name.", samples
    )


def _hops(hops: Iterable[HopHealth]) -> Iterator[str]:
    known = [(labels_of(hop=hop.hop), hop) for hop in hops]
    up = ((labels, hop.state == "ok") for labels, hop in known)
    yield from family("hop_up", "gauge", "1 while the hop works, else 0.", up)
    lag = ((labels, hop.lag_s) for labels, hop in known)
    yield from family(
        "lag_seconds", "gauge", "Lag of the heartbeat probe at the hop.", lag
    )
    growing = (
        (labels, None if hop.lag_s is None else hop.growing) for labels, hop in known
    )
    yield from family(
        "lag_growing", "gauge", "1 while that lag grows, else 0.", growing
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
        samples = ((labels_of(**{label: key}), count) for key, count in counts.items())
        yield from family(name, kind, text, samples)


def _turns(longest_s: float) -> Iterator[str]:
    yield from family(
        "loop_longest_turn_seconds",
        "gauge",
        "CPU time of the longest turn of the loop in the last two minutes.",
        [("", round(longest_s, 4))],
    )


def _safety(safety: Safety) -> Iterator[str]:
    latency = safety.alert_latency
    asked, margin = safety.not_echoed, safety.negative_margin
    worst = safety.worst_margin.margin
    yield from family(
        "alert_latency_seconds",
        "gauge",
        "Time from a detection of a person to the robot's report, last five minutes.",
        [
            (labels_of(quantile="0.5"), _seconds(latency.p50_ms)),
            (labels_of(quantile="0.95"), _seconds(latency.p95_ms)),
            (labels_of(quantile="0.99"), _seconds(latency.p99_ms)),
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
        yield from family(name, "gauge", text, [("", value)])


def _protection(counters: Mapping[str, int]) -> Iterator[str]:
    slow_s, fast_s = (counters.get(f"near_s.{how}", 0) for how in ("slow", "fast"))
    near_s = slow_s + fast_s
    yield from family(
        "protection_ratio",
        "gauge",
        "Share of the time near a person in sight that robots drove slowly.",
        [("", slow_s / near_s if near_s else None)],
    )


def _seconds(ms: float | None) -> float | None:
    return None if ms is None else ms / 1000.0
