"""Recordings over HTTP: the world at any moment, and files of inputs."""

from typing import Annotated

from fastapi import APIRouter, HTTPException, Query, Response
from fastapi.responses import FileResponse

from iveg.adapters.recordings.recorder import InputRecorder
from iveg.models.base import Listing
from iveg.models.health import Recording
from iveg.models.snapshot import PastWorld
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.history_filters import Moment
from iveg.web.live.pictures import Past
from iveg.web.security.requirements import READERS

MEDIA_TYPE = "application/vnd.mcap"


def router(recordings: InputRecorder, past: Past, clock: Clock) -> APIRouter:
    """Recordings as files, and the world at a recorded moment."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["history"],
        dependencies=READERS,
    )

    @routes.get("/recordings", response_model=Listing[Recording])
    async def listing() -> Response:
        """Recordings of inputs, oldest first."""
        files = await recordings.files()
        return Json(Listing(items=[Recording.from_value(file) for file in files]))

    @routes.get(
        "/recordings/{recording_id}",
        response_class=FileResponse,
        responses={200: {"content": {MEDIA_TYPE: {}}}},
    )
    async def recording(recording_id: str) -> FileResponse:
        """The recording of this name as MCAP; 404 while it is still written."""
        path = await recordings.finished(recording_id)
        if path is None:
            raise HTTPException(404, "There is no such recording that is finished.")
        return FileResponse(path, media_type=MEDIA_TYPE, filename=recording_id)

    @routes.get("/world", response_model=PastWorld)
    async def world(
        at: Annotated[Moment, Query(description="Which moment (ISO-8601)")],
    ) -> Response:
        """The world at a recorded moment, as pages got it then."""
        wall = at.timestamp()
        if wall > clock().wall:
            raise HTTPException(422, "That moment is still to come.")
        return Response(await past.world(wall), media_type="application/json")

    return routes
