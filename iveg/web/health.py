"""Whether the chain is whole: for people, for supervisors, for Prometheus."""

from collections.abc import Callable

from fastapi import APIRouter, Depends
from starlette.responses import PlainTextResponse, Response

from iveg.domain.observations import Instant
from iveg.models.health import Health, Hop
from iveg.web.answers import Json
from iveg.web.auth import require


def router(
    clock: Callable[[], Instant],
    health: Callable[[Instant], Health],
) -> APIRouter:
    """The endpoints that machines ask."""
    routes = APIRouter(tags=["health"])

    @routes.get("/healthz", dependencies=[Depends(require("open"))])
    async def alive() -> Response:
        """The process answers; says nothing else to strangers."""
        return PlainTextResponse("ok\n")

    @routes.get("/readyz", dependencies=[Depends(require("read"))])
    async def ready() -> Response:
        """200 when every hop is well, else 503."""
        state = health(clock())
        return Json({"ok": state.ok}, 200 if state.ok else 503)

    @routes.get("/metrics", dependencies=[Depends(require("read"))])
    async def metrics() -> Response:
        """Counters in Prometheus' text format."""
        state = health(clock())
        lines = ["# TYPE iveg_events_total counter"]
        lines += [
            f'iveg_events_total{{name="{name}"}} {count}'
            for name, count in state.counters.items()
        ]
        lines.append("# TYPE iveg_hop_up gauge")
        lines += [
            f'iveg_hop_up{{hop="{hop.hop}"}} {int(hop.state == "ok")}'
            for hop in state.hops
        ]
        lines += _lag_lines(state.hops)
        return PlainTextResponse("\n".join(lines) + "\n")

    return routes


def _lag_lines(hops: list[Hop]) -> list[str]:
    """How late measures pass each hop that a probe tells of."""
    known = [hop for hop in hops if hop.lag_s is not None]
    return [
        "# TYPE iveg_lag_seconds gauge",
        *(f'iveg_lag_seconds{{hop="{hop.hop}"}} {hop.lag_s}' for hop in known),
        "# TYPE iveg_lag_growing gauge",
        *(f'iveg_lag_growing{{hop="{hop.hop}"}} {int(hop.growing)}' for hop in known),
    ]
