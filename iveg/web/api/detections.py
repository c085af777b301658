"""Each detection of the last moments (docs/interfaces/http.md, "Each detection")."""

from collections.abc import Sequence
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from iveg.adapters.history.lists import USUAL_ROWS
from iveg.domain.records import DetectionRecord
from iveg.models.base import Listing, write_json
from iveg.models.kept_detection import DetectionRow
from iveg.pipeline.newest_detections import NewestDetections
from iveg.web.api import exports
from iveg.web.api.answers import FEW_ROWS, Apart
from iveg.web.api.exports import MEDIA_TYPES, Form
from iveg.web.api.history_filters import NewestFilters, admitting
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require


def router(newest: NewestDetections, worker: Apart) -> APIRouter:
    """Each detection, which the history does not keep; answers are made apart."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["live"],
        dependencies=[Depends(require("read"))],
        responses=refusals(503),
    )

    @routes.get(
        "/detections/latest",
        response_model=Listing[DetectionRow],
        responses={200: {"content": {one: {} for one in MEDIA_TYPES.values()}}},
    )
    async def latest(
        request: Request, asked: Annotated[NewestFilters, Query()]
    ) -> Response:
        """Each detection of the last moments, none left out, newest first."""
        form = asked.format or exports.form_of(request.headers)
        rows = newest.rows(admitting(asked), asked.limit or USUAL_ROWS)
        is_few = len(rows) <= FEW_ROWS
        body = _write(form, rows) if is_few else await worker.run(_write, form, rows)
        return Response(body, media_type=MEDIA_TYPES[form])

    return routes


def _write(form: Form, rows: Sequence[DetectionRecord]) -> bytes:
    if form == "csv":
        return exports.csv_head(DetectionRecord) + exports.csv_rows(
            DetectionRecord, rows
        )
    if form == "ndjson":
        return exports.ndjson_rows(DetectionRow.of_row, ((one,) for one in rows))
    return write_json(
        {"items": [DetectionRow.of_row(one) for one in rows], "next": None}
    )
