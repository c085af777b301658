"""Marks "not a person here" over HTTP (docs/interfaces/http.md)."""

from datetime import timedelta
from typing import Annotated

from fastapi import APIRouter, Depends, Response
from pydantic import Field

from iveg.models.base import Body, Listing
from iveg.models.thing import Thing
from iveg.pipeline.ports import Clock
from iveg.pipeline.things import ThingMarks
from iveg.web.api.answers import Json
from iveg.web.pages.local_time import in_madrid, start_of
from iveg.web.refusals import refusals
from iveg.web.security.authentication import Principal, require

Marking = Annotated[Principal, Depends(require("release"))]


class MarkRequest(Body):
    """Which track is no person."""

    person_id: Annotated[str, Field(min_length=1, max_length=64)]


def router(marks: ThingMarks, clock: Clock) -> APIRouter:
    """Read by all, made and taken back by operators."""
    routes = APIRouter(prefix="/api/v1", tags=["people"])
    reader = [Depends(require("read"))]

    @routes.get("/things", response_model=Listing[Thing], dependencies=reader)
    async def things() -> Response:
        """Every place that is marked "not a person here"."""
        return Json(Listing(items=[Thing.of(one) for one in marks.known]))

    @routes.post(
        "/things", status_code=201, response_model=Thing, responses=refusals(404, 409)
    )
    async def mark(body: MarkRequest, who: Marking) -> Response:
        """Mark where a track is, until the end of the day at the latest.

        409 for whoever came from elsewhere, moved or was surely seen.
        """
        now = clock()
        tomorrow = in_madrid(now.wall).date() + timedelta(days=1)
        thing = marks.mark(body.person_id, who.name, start_of(tomorrow), now)
        return Json(Thing.of(thing), 201)

    @routes.delete("/things/{thing_id}", response_model=Thing)
    async def unmark(thing_id: str, who: Marking) -> Response:
        """Take a mark back: from now on whoever is there is somebody."""
        return Json(Thing.of(marks.unmark(thing_id, who.name, clock())))

    return routes
