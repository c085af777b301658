"""Detections over HTTP (docs/interfaces/http.md), and operators' answers about them.

An answer takes a detector out of service, gives a word a meaning, or marks a thing.
"""

import asyncio
from collections.abc import Sequence
from datetime import timedelta
from typing import Annotated, Self

from fastapi import APIRouter, Query, Response
from pydantic import AfterValidator, Field, model_validator

from iveg.adapters.history.lists import USUAL_ROWS
from iveg.domain.detector import WordAnswer
from iveg.domain.records import DetectionRecord
from iveg.domain.wire import legible
from iveg.models.base import Body, Listing
from iveg.models.people import DetectionRow, Thing
from iveg.models.robot import Detector
from iveg.vital.detections import NewestDetections
from iveg.vital.operators import Detectors, ThingMarks
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.history_filters import RowFilters, admitting
from iveg.web.pages.sentences import in_madrid, start_of
from iveg.web.security.requirements import READERS, Operator


def router(newest: NewestDetections) -> APIRouter:
    """The route of every recent detection; the history keeps only some of them."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["live"],
        dependencies=READERS,
    )

    @routes.get(
        "/detections/latest",
        response_model=Listing[DetectionRow],
    )
    async def latest(filters: Annotated[RowFilters, Query()]) -> Response:
        """All detections of the last moments, newest first."""
        rows = newest.rows(admitting(filters), filters.limit or USUAL_ROWS)
        # Up to 1,000 rows: the loop must not wait while they become JSON.
        return await asyncio.to_thread(_listing, rows)

    return routes


def _listing(records: Sequence[DetectionRecord]) -> Json:
    return Json(Listing(items=[DetectionRow.from_record(row) for row in records]))


class ServiceRequest(Body):
    """Whether the detector is required."""

    in_service: bool
    reason: Annotated[
        str,
        Field(max_length=200),
        AfterValidator(lambda text: " ".join(legible(text).split())),
    ] = ""

    @model_validator(mode="after")
    def _out_for_a_reason(self) -> Self:
        if not (self.in_service or self.reason):
            raise ValueError("out of service needs a reason")
        return self


Name = Annotated[str, Field(min_length=1, max_length=64)]


class WordRequest(Body):
    """Meaning of a detector's word."""

    detector: Name
    word: Name
    is_person: bool
    sure: bool = Field(
        default=False, description="Asked a second time; needed for ``false``."
    )

    @model_validator(mode="after")
    def _is_confirmed(self) -> Self:
        # A word that is no person makes no zone, so the operator must confirm it.
        if not (self.is_person or self.sure):
            raise ValueError("that it is no person has to be sure")
        return self


class MarkRequest(Body):
    """Track that is no person."""

    person_id: Name


def words_router(detectors: Detectors, marks: ThingMarks, clock: Clock) -> APIRouter:
    """Routes of operators: detectors in service, meanings of words, marks."""
    routes = APIRouter(prefix="/api/v1")

    @routes.put(
        "/robots/{robot_id}/detector",
        response_model=Detector,
        tags=["robots"],
    )
    async def service(
        robot_id: str,
        body: ServiceRequest,
        who: Operator,
    ) -> Response:
        """Take a detector out of service until its robot's next boot, or put it back.

        Taking it out needs a ``reason``.

        While it is out of service its frames are not required.
        """
        now = clock()
        robot = await detectors.set_in_service(
            robot_id,
            who.name,
            now,
            in_service=body.in_service,
            reason=body.reason,
        )
        return Json(Detector.from_robot(robot, now))

    @routes.put("/words", status_code=204, tags=["people"])
    async def answer(body: WordRequest, who: Operator) -> Response:
        """Answer whether an unknown word stands for a person."""
        now = clock()
        word = WordAnswer(body.detector, body.word, body.is_person, who.name, now.wall)
        await detectors.answer(word, now)
        return Response(status_code=204)

    @routes.get(
        "/things", response_model=Listing[Thing], dependencies=READERS, tags=["people"]
    )
    async def things() -> Response:
        """Every place that an operator marked."""
        return Json(Listing(items=[Thing.from_value(thing) for thing in marks.known]))

    @routes.post(
        "/things",
        status_code=201,
        response_model=Thing,
        tags=["people"],
    )
    async def mark(body: MarkRequest, who: Operator) -> Response:
        """Mark the place of a track, until the day's end.

        409 for a track that came from elsewhere, moved or was surely seen.
        """
        now = clock()
        # Its cost is a person who stands still inside, so no mark outlives its day.
        until = start_of(in_madrid(now.wall).date() + timedelta(days=1))
        thing = marks.mark(body.person_id, who.name, until, now)
        return Json(Thing.from_value(thing), 201)

    @routes.delete("/things/{thing_id}", response_model=Thing, tags=["people"])
    async def unmark(thing_id: str, who: Operator) -> Response:
        """Take a mark back: tracks there have zones from now on."""
        return Json(Thing.from_value(marks.unmark(thing_id, who.name, clock())))

    return routes
