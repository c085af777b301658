"""Marks "not a person here" and "known here" over HTTP (docs/interfaces/http.md)."""

from datetime import timedelta
from typing import Annotated, Self

from fastapi import APIRouter, Depends, Response
from pydantic import Field, model_validator

from iveg.domain.rule.known_here import KnownHere
from iveg.models.base import Body, Listing
from iveg.models.thing import KnownSpot, Thing
from iveg.pipeline.ports import Clock
from iveg.pipeline.things import ThingMarks
from iveg.web.api.answers import Json
from iveg.web.pages.local_time import in_madrid, start_of
from iveg.web.refusals import refusals
from iveg.web.security.requirements import Operator, require

Name = Annotated[str, Field(min_length=1, max_length=64)]


class MarkRequest(Body):
    """Which track is no person, or which robot's laser sees what is known."""

    person_id: Name | None = None
    robot_id: Name | None = None

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.person_id is None) == (self.robot_id is None):
            raise ValueError("names one of person_id and robot_id")
        return self


def router(marks: ThingMarks, known: KnownHere, clock: Clock) -> APIRouter:
    """Read by all, made and taken back by operators."""
    routes = APIRouter(prefix="/api/v1", tags=["people"])
    reader = [Depends(require("read"))]

    @routes.get("/things", response_model=Listing[Thing], dependencies=reader)
    async def things() -> Response:
        """Every place that an operator marked."""
        return Json(Listing(items=[Thing.of(one) for one in marks.known]))

    @routes.get("/known-here", response_model=Listing[KnownSpot], dependencies=reader)
    async def known_here() -> Response:
        """Every place where what stands still slows nobody, marked or learnt."""
        marked = (
            KnownSpot.marked(one) for one in marks.known if one.kind == "obstacle"
        )
        learnt = (
            KnownSpot.learnt(one.x, one.y, one.known_since)
            for one in known.known
            if one.known_since is not None
        )
        return Json(Listing(items=[*marked, *learnt]))

    @routes.post(
        "/things", status_code=201, response_model=Thing, responses=refusals(404, 409)
    )
    async def mark(body: MarkRequest, who: Operator) -> Response:
        """Mark where a track is, or what a robot's laser sees, until the day's end.

        409 for whoever came from elsewhere, moved or was surely seen.
        """
        now = clock()
        until = start_of(in_madrid(now.wall).date() + timedelta(days=1))
        if body.person_id is not None:
            thing = marks.mark(body.person_id, who.name, until, now)
        else:
            thing = marks.mark_obstacle(body.robot_id or "", who.name, until, now)
        return Json(Thing.of(thing), 201)

    @routes.delete("/things/{thing_id}", response_model=Thing)
    async def unmark(thing_id: str, who: Operator) -> Response:
        """Take a mark back: from now on whoever is there is somebody."""
        return Json(Thing.of(marks.unmark(thing_id, who.name, clock())))

    return routes
