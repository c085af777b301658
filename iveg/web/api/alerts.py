"""Acknowledgement of alerts, one or a list: by whom, when, and with which note."""

from typing import Annotated

from fastapi import APIRouter, HTTPException, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.models.alert import AcknowledgedAlerts, Alert
from iveg.ngsi.texts import clean_text
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import Operator

MOST_TOGETHER = 200
"""More alerts at once nobody has read."""


class Acknowledgement(BaseModel):
    """The note of the person."""

    model_config = ConfigDict(strict=True, extra="ignore")

    note: Annotated[str, Field(max_length=200)] = ""


class AcknowledgementTogether(Acknowledgement):
    """The alerts that the person saw in a list, and the note on all of them."""

    alert_ids: Annotated[
        list[Annotated[str, Field(pattern=r"^[ -~]{1,64}$")]],
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
        """Say that somebody has seen it; it stays listed while it is active."""
        note = clean_text(body.note)
        found = evaluator.alerts.acknowledge(alert_id, who.name, note, clock())
        if found is None:
            raise HTTPException(404, "There is no such alert.")
        return Json(Alert.of(found))

    @routes.post("/alerts/acknowledge", response_model=AcknowledgedAlerts)
    async def acknowledge_together(
        body: AcknowledgementTogether,
        who: Operator,
    ) -> Response:
        """Say that somebody has seen a list; a P1 is left to be seen by itself."""
        note = clean_text(body.note)
        seen = evaluator.alerts.acknowledge_together(
            body.alert_ids, who.name, note, clock()
        )
        ids = {one.alert_id for one in seen}
        left = [one for one in body.alert_ids if one not in ids]
        items = [Alert.of(one) for one in seen]
        return Json(AcknowledgedAlerts(items=items, left=left))

    return routes
