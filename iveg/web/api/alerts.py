"""Acknowledgement of alerts, and notes of people, over HTTP.

A note is a line of the log, pinned to a time and a place.  It is written once, and goes
into the incident packs of its moment.
"""

from collections.abc import Callable
from typing import Annotated, Self

from fastapi import APIRouter, HTTPException, Query, Response
from pydantic import BaseModel, ConfigDict, Field, model_validator

from iveg.adapters.history import lists
from iveg.adapters.history.queries import Queries
from iveg.domain.events import LogEvent, Slot
from iveg.domain.observations import Instant
from iveg.domain.wire import clean_text, legible
from iveg.models.base import Listing
from iveg.models.history import AcknowledgedAlerts, Alert, Note
from iveg.vital.evaluate import Evaluator
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.history_filters import Moment, RecordId, Span, seconds
from iveg.web.pages.sentences import local_stamp
from iveg.web.security.requirements import READERS, Operator

MOST_TOGETHER = 200
"""Alerts in one acknowledgement: nobody has read more of them at once."""


class Acknowledgement(BaseModel):
    """The note of the person."""

    model_config = ConfigDict(strict=True, extra="ignore")

    note: Annotated[str, Field(max_length=200)] = ""


class AcknowledgementTogether(Acknowledgement):
    """The alerts that the person saw in a list, and the note on all of them."""

    alert_ids: Annotated[
        list[RecordId],
        Field(max_length=MOST_TOGETHER),
    ]


def router(evaluator: Evaluator, clock: Clock) -> APIRouter:
    """Routes of alerts."""
    routes = APIRouter(prefix="/api/v1", tags=["alerts"])

    @routes.post("/alerts/{alert_id}/acknowledge", response_model=Alert)
    async def acknowledge(
        alert_id: str,
        body: Acknowledgement,
        who: Operator,
    ) -> Response:
        """Acknowledge an alert; it stays listed while it is active."""
        note = clean_text(body.note)
        alert = evaluator.alerts.acknowledge(alert_id, who.name, note, clock())
        if alert is None:
            raise HTTPException(404, "There is no such alert.")
        return Json(Alert.from_alert(alert))

    @routes.post("/alerts/acknowledge", response_model=AcknowledgedAlerts)
    async def acknowledge_together(
        body: AcknowledgementTogether,
        who: Operator,
    ) -> Response:
        """Acknowledge a list of alerts; each P1 is left to be acknowledged singly."""
        note = clean_text(body.note)
        acknowledged = evaluator.alerts.acknowledge_together(
            body.alert_ids, who.name, note, clock()
        )
        ids = {alert.alert_id for alert in acknowledged}
        other_ids = [alert_id for alert_id in body.alert_ids if alert_id not in ids]
        items = [Alert.from_alert(alert) for alert in acknowledged]
        return Json(AcknowledgedAlerts(items=items, left=other_ids))

    return routes


KEY = lists.NOTE
MOST_TEXT = 1000
LONGEST_AGO_S = 400 * 86_400.0
_FARTHEST_M = 1e4
_Metres = Annotated[float, Field(ge=-_FARTHEST_M, le=_FARTHEST_M)]


class NoteRequest(BaseModel):
    """A note; without a time it is about now."""

    model_config = ConfigDict(extra="forbid")

    text: Annotated[str, Field(max_length=MOST_TEXT)]
    at: Moment | None = None
    x: _Metres | None = None
    y: _Metres | None = None
    robot_id: RecordId | None = None
    decision_id: RecordId | None = None

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if (self.x is None) != (self.y is None):
            raise ValueError("a place has both x and y")
        if not self.text.strip() or legible(self.text) != self.text:
            raise ValueError("a note has a text, without marks that turn it round")
        return self


def notes_router(
    queries: Queries,
    log: Callable[[LogEvent, Instant], None],
    clock: Clock,
) -> APIRouter:
    """Routes of notes: read by all, written by operators.

    Args:
        queries: The history.
        log: Takes the lines.
        clock: Moment of a note without a time.
    """
    routes = APIRouter(prefix="/api/v1", tags=["history"])

    @routes.get(
        "/notes",
        response_model=Listing[Note],
        dependencies=READERS,
    )
    async def notes(span: Annotated[Span, Query()]) -> Response:
        """Notes by their time of writing, newest first."""
        since, until = seconds(span.since), seconds(span.until)
        filters = lists.Filter(since=since, until=until, limit=lists.MOST_ROWS)
        page = await queries.page(lists.NOTES, filters)
        return Json(Listing(items=[Note.from_record(line) for line in page.items]))

    @routes.post("/notes", status_code=201)
    async def write(body: NoteRequest, who: Operator) -> dict[str, str]:
        """Write a note, which cannot be taken back."""
        now = clock()
        pinned_at = now.wall if body.at is None else body.at.timestamp()
        if not now.wall - LONGEST_AGO_S <= pinned_at <= now.wall:
            raise HTTPException(422, "A note is about a moment of the last 400 days.")
        slots: dict[str, Slot] = {
            "by": who.name,
            "text": body.text,
            # The sentence shows Madrid's time; programs read the seconds.
            "pinned": local_stamp(pinned_at),
            "pinned_at": pinned_at,
        }
        if body.x is not None:
            slots |= {"x": body.x, "y": body.y}
        log(
            LogEvent("system", KEY, slots, body.robot_id, decision_id=body.decision_id),
            now,
        )
        return {"detail": "It is on the record."}

    return routes
