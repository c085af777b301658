"""Tiles of other equipment over HTTP (docs/interfaces/http.md)."""

from fastapi import APIRouter, Depends, Response

from iveg.models.base import Listing
from iveg.models.equipment import Tile
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import require
from iveg.web.views import Views


def router(views: Views, clock: Clock) -> APIRouter:
    """The route of the tiles."""
    routes = APIRouter(
        prefix="/api/v1", tags=["live"], dependencies=[Depends(require("read"))]
    )

    @routes.get("/equipment", response_model=Listing[Tile])
    async def equipment() -> Response:
        """Tiles of other equipment, each with its newest number and state."""
        return Json(Listing(items=views.equipment(clock())))

    return routes
