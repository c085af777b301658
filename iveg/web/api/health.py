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
    """Depth of queues, and drops.

    Attributes:
        depths: Queue → number of waiting items.
        dropped: Queue → items dropped since the start.
    """

    depths: Mapping[str, int]
    dropped: Mapping[str, int]


class _Computed(Collector):
    """Families that were computed for a single request."""

    def __init__(self, families: list[Metric]) -> None:
        self._families = families

    def collect(self) -> Iterable[Metric]:
        """All families."""
        return self._families


def _family(
    type_: str, name: str, text: str, label: str, samples: Mapping[str, float | None]
) -> Metric:
    """One family of metrics; unknown values are left out."""
    metric = Metric(f"iveg_{name}", text, type_)
    sample = f"iveg_{name}_total" if type_ == "counter" else f"iveg_{name}"
    for key, value in samples.items():
        # A zero for an unknown lag or clock would look healthy.
        if value is not None:
            metric.add_sample(sample, {label: key} if label else {}, value)
    return metric


def _families(health: Health, watch: LatencyWatch, queues: Queues) -> list[Metric]:
    hops, clocks = health.hops, watch.clocks
    return [
        _family(*row)
        for row in (
            ("counter", "events", "Events since the start.", "name", health.counters),
            (
                "gauge",
                "hop_up",
                "1 while the hop works, else 0.",
                "hop",
                {hop.hop: hop.state == "ok" for hop in hops},
            ),
            (
                "gauge",
                "lag_seconds",
                "Lag of the heartbeat probe at the hop.",
                "hop",
                {hop.hop: hop.lag_s for hop in hops},
            ),
            (
                "gauge",
                "clock_offset_seconds",
                "Clock of the robot minus clock of the server.",
                "robot",
                {robot: clock.offset_s for robot, clock in clocks.items()},
            ),
            (
                "gauge",
                "clock_uncertainty_seconds",
                "Greatest error of that offset.",
                "robot",
                {robot: clock.uncertainty_s for robot, clock in clocks.items()},
            ),
            ("gauge", "queue_depth", "Items in the queue.", "queue", queues.depths),
            ("counter", "dropped", "Items dropped.", "queue", queues.dropped),
        )
    ]


def _summary(latency: _Latency) -> Metric:
    """Quantiles, sum and count of each hop."""
    name = "iveg_latency_seconds"
    text = "Latency of a hop; quantiles are of the last 15 minutes."
    metric = Metric(name, text, "summary")
    for (robot, data, hop), count, total, sketches in latency:
        labels, sketch = {"robot": robot, "data": data, "hop": hop}, merged(sketches)
        for share in _SHARES:
            value = sketch.quantile(share)
            if value is not None:
                metric.add_sample(name, {**labels, "quantile": f"{share:g}"}, value)
        metric.add_sample(f"{name}_sum", labels, total)
        metric.add_sample(f"{name}_count", labels, count)
    return metric


_READY: dict[int | str, dict[str, Any]] = {503: {"description": "A hop is not well."}}


def router(
    clock: Clock,
    health: Callable[[Instant], Health],
    accounts: Callable[[], str],
    watch: LatencyWatch,
    queues: Callable[[], Queues],
) -> APIRouter:
    """Routes for supervisors and Prometheus."""
    routes = APIRouter(tags=["health"])

    @routes.get(
        "/healthz",
        dependencies=STRANGERS,
        response_class=PlainTextResponse,
    )
    async def alive() -> Response:
        """Liveness: the process answers, and shows strangers nothing else."""
        return PlainTextResponse("ok\n")

    @routes.get("/readyz", dependencies=READERS, responses=_READY)
    async def ready() -> Response:
        """200 when every hop and the file of accounts are well, else 503."""
        # A damaged file of accounts may lock people out while every hop works.
        accounts_state = accounts()
        is_ok = health(clock()).ok and accounts_state == "ok"
        return Json({"ok": is_ok, "accounts": accounts_state}, 200 if is_ok else 503)

    @routes.get(
        "/metrics",
        dependencies=READERS,
        response_class=PlainTextResponse,
    )
    async def metrics() -> Response:
        """Counters, hops, latency and safety in Prometheus' text format."""
        families = _families(health(clock()), watch, queues())
        latency: _Latency = [
            (
                (stream.robot_id, stream.data, hop),
                part.count,
                part.total,
                part.parts(),
            )
            for stream in watch.streams.values()
            for hop, part in stream.segments.items()
            if part.count
        ]
        # Twenty robots have 300 sketches to sum up: beside the loop, not in it.
        text = await asyncio.to_thread(
            lambda: generate_latest(_Computed([*families, _summary(latency)]))
        )
        return Response(text, media_type=CONTENT_TYPE_PLAIN_0_0_4)

    return routes
