"""Health of the data path: for supervisors, and as metrics for Prometheus.

``deploy/grafana`` draws them, and a test compares its names with these.
"""

import asyncio
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import APIRouter, Response
from fastapi.responses import PlainTextResponse
from prometheus_client import CONTENT_TYPE_PLAIN_0_0_4, generate_latest
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from iveg.domain.latency import LatencyWatch, Sketch, merged
from iveg.domain.observations import Instant
from iveg.models.health import Health
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import READERS, STRANGERS

_SHARES = (0.5, 0.95, 0.99)
_Latency = list[tuple[tuple[str, str, str], int, float, list[Sketch]]]


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


class _Told(Collector):
    """Families that were computed for one request."""

    def __init__(self, families: list[Metric]) -> None:
        self._families = families

    def collect(self) -> Iterable[Metric]:
        """All of them."""
        return self._families


def _family(
    kind: str,
    name: str,
    text: str,
    samples: Mapping[str, float | None],
    label: str = "",
) -> Metric:
    """One family; samples that nobody knows are left out."""
    made = Metric(f"iveg_{name}", text, kind)
    sample = f"iveg_{name}_total" if kind == "counter" else f"iveg_{name}"
    for key, value in samples.items():
        if value is not None:
            made.add_sample(sample, {label: key} if label else {}, value)
    return made


def _families(health: Health, watch: LatencyWatch, queues: Queues) -> list[Metric]:
    return [
        _family(
            "counter",
            "events",
            "Events since the start, by name.",
            health.counters,
            "name",
        ),
        _family(
            "gauge",
            "hop_up",
            "1 while the hop works, else 0.",
            {one.hop: one.state == "ok" for one in health.hops},
            "hop",
        ),
        _family(
            "gauge",
            "lag_seconds",
            "Lag of the heartbeat probe at the hop.",
            {one.hop: one.lag_s for one in health.hops},
            "hop",
        ),
        _family(
            "gauge",
            "lag_growing",
            "1 while that lag grows, else 0.",
            {one.hop: one.growing for one in health.hops if one.lag_s is not None},
            "hop",
        ),
        _family(
            "gauge",
            "clock_offset_seconds",
            "Clock of the robot minus clock of the server.",
            {robot: one.offset_s for robot, one in watch.clocks.items()},
            "robot",
        ),
        _family(
            "gauge",
            "clock_uncertainty_seconds",
            "Greatest error of that offset.",
            {robot: one.uncertainty_s for robot, one in watch.clocks.items()},
            "robot",
        ),
        _family("gauge", "queue_depth", "Items in the queue.", queues.depths, "queue"),
        _family(
            "counter",
            "dropped",
            "Items that a full queue dropped.",
            queues.dropped,
            "queue",
        ),
        _family("counter", "retries", "Repeated operations.", queues.retries, "what"),
    ]


def _summary(latency: _Latency) -> Metric:
    """Quantiles, sum and count of each hop."""
    name = "iveg_latency_seconds"
    text = "Latency of a hop; quantiles are of the last minute."
    made = Metric(name, text, "summary")
    for (robot, data, hop), count, total, sketches in latency:
        labels, sketch = {"robot": robot, "data": data, "hop": hop}, merged(sketches)
        for share in _SHARES:
            value = sketch.quantile(share)
            if value is not None:
                made.add_sample(name, {**labels, "quantile": f"{share:g}"}, value)
        made.add_sample(f"{name}_sum", labels, total)
        made.add_sample(f"{name}_count", labels, count)
    return made


_READY: dict[int | str, dict[str, Any]] = {503: {"description": "A hop is not well."}}


def router(
    clock: Clock,
    health: Callable[[Instant], Health],
    accounts: Callable[[], str],
    watch: LatencyWatch,
    queues: Callable[[], Queues],
    longest_turn_s: Callable[[Instant], float],
) -> APIRouter:
    """The endpoints that machines ask."""
    routes = APIRouter(tags=["health"])

    @routes.get(
        "/healthz",
        dependencies=STRANGERS,
        response_class=PlainTextResponse,
    )
    async def alive() -> Response:
        """The process answers; says nothing else to strangers."""
        return PlainTextResponse("ok\n")

    @routes.get("/readyz", dependencies=READERS, responses=_READY)
    async def ready() -> Response:
        """200 when every hop and the file of accounts are well, else 503."""
        kept = accounts()
        is_ok = health(clock()).ok and kept == "ok"
        return Json({"ok": is_ok, "accounts": kept}, 200 if is_ok else 503)

    @routes.get(
        "/metrics",
        dependencies=READERS,
        response_class=PlainTextResponse,
    )
    async def metrics() -> Response:
        """Counters, hops, latency and safety in Prometheus' text format."""
        now = clock()
        families = [
            *_families(health(now), watch, queues()),
            _family(
                "gauge",
                "loop_longest_turn_seconds",
                "CPU time of the longest turn of the loop in the last two minutes.",
                {"": round(longest_turn_s(now), 4)},
            ),
        ]
        latency: _Latency = [
            ((one.robot_id, one.data, hop), part.count, part.total, part.parts("1min"))
            for one in watch.streams
            for hop, part in one.segments.items()
            if part.count
        ]
        # Twenty robots have 300 sketches to sum up: beside the loop, not in it.
        text = await asyncio.to_thread(
            lambda: generate_latest(_Told([*families, _summary(latency)]))
        )
        return Response(text, media_type=CONTENT_TYPE_PLAIN_0_0_4)

    return routes
