"""Acknowledgement of alerts: by whom, when, and with which note."""

from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.models.alert import Alert
from iveg.ngsi.payloads import clean_text
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.authentication import Principal, require


class Acknowledgement(BaseModel):
    """The note of the person."""

    model_config = ConfigDict(strict=True, extra="ignore")

    note: Annotated[str, Field(max_length=200)] = ""


def router(evaluator: Evaluator, clock: Clock) -> APIRouter:
    """Routes of alerts."""
    routes = APIRouter(prefix="/api/v1", tags=["alerts"])

    @routes.post("/alerts/{alert_id}/acknowledge", response_model=Alert)
    async def acknowledge(
        alert_id: str,
        body: Acknowledgement,
        who: Annotated[Principal, Depends(require("release"))],
    ) -> Response:
        """Say that somebody has seen it; it stays listed while it is active."""
        note = clean_text(body.note)
        found = evaluator.alerts.acknowledge(alert_id, who.name, note, clock())
        if found is None:
            raise HTTPException(404, "There is no such alert.")
        return Json(Alert.of(found))

    return routes
