"""Health of the data path: for people, supervisors and Prometheus."""

from collections.abc import Callable
from typing import Any

from fastapi import APIRouter, Depends, Response
from fastapi.responses import PlainTextResponse

from iveg.domain.observations import Instant
from iveg.models.health import Health
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import require

_READY: dict[int | str, dict[str, Any]] = {503: {"description": "A hop is not well."}}


def router(
    clock: Clock,
    health: Callable[[Instant], Health],
) -> APIRouter:
    """The endpoints that machines ask."""
    routes = APIRouter(tags=["health"])

    @routes.get(
        "/healthz",
        dependencies=[Depends(require("open"))],
        response_class=PlainTextResponse,
    )
    async def alive() -> Response:
        """The process answers; says nothing else to strangers."""
        return PlainTextResponse("ok\n")

    @routes.get("/readyz", dependencies=[Depends(require("read"))], responses=_READY)
    async def ready() -> Response:
        """200 when every hop is well, else 503."""
        state = health(clock())
        return Json({"ok": state.ok}, 200 if state.ok else 503)

    return routes
