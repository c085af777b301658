"""Recordings of what came in over HTTP (docs/interfaces/recordings.md)."""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from fastapi import APIRouter, Depends, HTTPException, Response
from fastapi.responses import FileResponse

from iveg.domain.recordings import RecordingFile
from iveg.models.base import Listing
from iveg.models.recordings import Recording
from iveg.web.api.answers import Json
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

MEDIA_TYPE = "application/vnd.mcap"


class Recordings(Protocol):
    """The recordings on the disk; each question may raise HopError."""

    async def files(self) -> Sequence[RecordingFile]:
        """All of them, oldest first."""

    async def finished(self, name: str) -> Path | None:
        """The file of one that is finished."""


def router(recordings: Recordings) -> APIRouter:
    """Their list, and each as a file."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["history"],
        dependencies=[Depends(require("read"))],
        responses=refusals(503),
    )

    @routes.get("/recordings", response_model=Listing[Recording])
    async def listing() -> Response:
        """Recordings of what came in, oldest first."""
        files = await recordings.files()
        return Json(Listing(items=[Recording.of(one) for one in files]))

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

    return routes
