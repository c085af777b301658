"""The world at any recorded moment (docs/interfaces/http.md, "The past")."""

from typing import Annotated, Protocol

from fastapi import APIRouter, Depends, HTTPException, Query, Response

from iveg.models.snapshot import PastWorld
from iveg.pipeline.ports import Clock
from iveg.web.api.history_filters import Moment
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

_VIEWER = r"^[A-Za-z0-9-]{1,64}$"


class Past(Protocol):
    """Runs the pipeline over what was recorded: ``app.viewers``."""

    async def world(self, viewer: str, wall: float) -> bytes:
        """The world at a moment (Unix s), as JSON.

        Raises:
            NotRecordedError: nothing was recorded there.
            UnreadableError: another version or fleet recorded it.
            HopError: too many look at once, or it could not be made.
        """


def router(past: Past, clock: Clock) -> APIRouter:
    """The route."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["history"],
        dependencies=[Depends(require("read"))],
        responses=refusals(400, 404, 503),
    )

    @routes.get("/world", response_model=PastWorld)
    async def world(
        at: Annotated[Moment, Query(description="Which moment (ISO-8601)")],
        viewer: Annotated[
            str,
            Query(pattern=_VIEWER, description="Any name; its next question is fast"),
        ] = "nobody",
    ) -> Response:
        """The world at a recorded moment, by the rule and program that ran then."""
        wall = at.timestamp()
        if wall > clock().wall:
            raise HTTPException(422, "That moment is still to come.")
        body = await past.world(viewer, wall)
        return Response(body, media_type="application/json")

    return routes
