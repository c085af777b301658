"""The history over HTTP: lists to filter and export, and figures.

Lists answer JSON, CSV or NDJSON, as ``Accept`` or ``format`` says.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Generic, TypeVar

from fastapi import APIRouter, Depends, HTTPException, Query, Request, Response
from fastapi.responses import StreamingResponse

from iveg.adapters import clock
from iveg.adapters.history import lists
from iveg.adapters.history.lists import Cursor, ListOf, Page
from iveg.adapters.history.queries import Queries
from iveg.adapters.worker import Worker
from iveg.domain.errors import HopError
from iveg.domain.fleet import NOBODY, FleetDescription
from iveg.domain.records import CommandRecord, DecisionRecord, Record
from iveg.models.base import Listing, Row
from iveg.models.command import Command
from iveg.models.history import (
    Alert,
    AuditEntry,
    Decision,
    LogEntry,
    Measurement,
    OdometryRow,
    Reading,
)
from iveg.models.people import DetectionRow
from iveg.vital.ports import Clock
from iveg.web.api import day, exports
from iveg.web.api.answers import Json
from iveg.web.api.exports import MEDIA_TYPES, Form
from iveg.web.api.history_filters import Filters, RecordId, filter_of
from iveg.web.security.requirements import READERS, require
from iveg.web.security.roles import Action

R = TypeVar("R", bound=Record)
Model = Callable[..., Row]


@dataclass(frozen=True, slots=True)
class HistoryList(Generic[R]):
    """One list: its source and its models.

    Attributes:
        shape: Model of a row.
        beside: Reads further data for the model of each record, in their order.
        needs: Right that a reader must have.
        present: Alerts of now, which lead their list and need no database.
    """

    path: str
    source: ListOf[R]
    shape: type[Row]
    says: str
    beside: Callable[[Sequence[R]], Awaitable[list[Any]]] | None = None
    needs: Action = "read"
    present: Callable[[], list[Alert]] = list

    async def rows(self, records: Sequence[R]) -> list[tuple[Any, ...]]:
        """Arguments of ``shape.from_record``, for each record."""
        if self.beside is None:
            return [(record,) for record in records]
        return list(zip(records, await self.beside(records), strict=True))


def lists_of(
    queries: Queries, alerts: Callable[[], list[Alert]] = list
) -> tuple[HistoryList[Any], ...]:
    """All lists of the history."""

    async def steps_of(records: Sequence[CommandRecord]) -> list[Any]:
        # All steps of a page in one query, not one query for each command.
        steps = await queries.steps_of([command.command_id for command in records])
        return [steps.get(command.command_id, ()) for command in records]

    return (
        HistoryList(
            "decisions",
            lists.DECISIONS,
            Decision,
            "Why robots were slowed, by when it began",
        ),
        HistoryList(
            "commands",
            lists.COMMANDS,
            Command,
            "Every STOP, release and resume, by when it was asked",
            beside=steps_of,
        ),
        HistoryList(
            "alerts",
            lists.ALERTS,
            Alert,
            "Every alert, by when it was last raised",
            present=alerts,
        ),
        HistoryList("log", lists.LOG, LogEntry, "The action and inference log"),
        HistoryList(
            "audit",
            lists.AUDIT,
            AuditEntry,
            "Who did what; `robot` asks for a subject, `class` for an action or name",
            needs="release",
        ),
        HistoryList(
            "detections",
            lists.DETECTIONS,
            DetectionRow,
            "What robots saw, by when it reached iVeg",
        ),
        HistoryList(
            "tracks",
            lists.TRACKS,
            DetectionRow,
            "Where people were: their detections, by when each reached iVeg",
        ),
        HistoryList(
            "odometry",
            lists.ODOMETRY,
            OdometryRow,
            "Poses and speeds of robots with their speed limits, twice a second",
        ),
        HistoryList(
            "readings",
            lists.READINGS,
            Reading,
            "What small sensors of robots said; `class` asks for a kind, as `battery`",
        ),
        HistoryList(
            "measurements",
            lists.MEASUREMENTS,
            Measurement,
            "Numbers of other equipment; `class` asks for an entity or an attribute",
        ),
    )


def router(
    queries: Queries,
    worker: Worker,
    *,
    present: Callable[[str], DecisionRecord | None],
    alerts: Callable[[], list[Alert]] = list,
    fleet: FleetDescription = NOBODY,
    read_clock: Clock = clock.now,
) -> APIRouter:
    """The routes of the history.

    Args:
        queries: Reading side of the history.
        worker: Writes files and draws figures.
        present: Finds a decision in memory, whose links are those of now.
        alerts: Alerts of now.
        fleet: Robots, whose greatest speeds a chart shows.
        read_clock: Gives the end of "the last 15 minutes".
    """
    routes = APIRouter(
        dependencies=READERS,
        tags=["history"],
    )
    for listed in lists_of(queries, alerts):
        _add_list(routes, queries, listed, worker)

    @routes.get(
        "/api/v1/decisions/{decision_id}",
        summary="One decision",
        response_model=Decision,
    )
    async def decision(
        decision_id: RecordId,
    ) -> Response:
        # Memory first: the history has an open decision without its last links.
        record = present(decision_id) or await queries.get(lists.DECISIONS, decision_id)
        if record is None:
            raise HTTPException(404, "There is no such decision.")
        return Json(Decision.from_record(record))

    day.add_routes(routes, queries, worker, fleet, read_clock)
    return routes


def _add_list(
    routes: APIRouter, queries: Queries, listed: HistoryList[R], worker: Worker
) -> None:
    @routes.get(
        f"/api/v1/{listed.path}",
        name=listed.path,
        summary=listed.says,
        response_model=Listing[listed.shape],  # type: ignore[name-defined]
        responses={200: {"content": _FILES}},
        dependencies=[Depends(require(listed.needs))],
    )
    async def listing(
        request: Request, filters: Annotated[Filters, Query()]
    ) -> Response:
        form = filters.format or exports.form_of(request.headers)
        database_filter = filter_of(filters, listed.source)
        # A file without a limit holds every row, so it reads the largest pages.
        if form != "json" and filters.limit is None:
            database_filter = replace(database_filter, limit=lists.MOST_ROWS)
        # The first page is read before the answer begins: later no status can refuse.
        # Alerts of now pass through no filter, so they lead the plain first page alone.
        is_plain = form == "json" and filters.model_fields_set <= {"limit", "format"}
        now = listed.present() if is_plain else []
        try:
            page = await queries.page(listed.source, database_filter)
        except HopError:
            # Alerts of now are shown even while the database is away.
            if not now:
                raise
            page = Page((), None)
        if form == "json":
            rows = await listed.rows(page.items)
            model = listed.shape.from_record
            return await asyncio.to_thread(_listing, model, rows, page.next, now)
        # With a limit the file ends after its first page.
        if filters.limit is not None:
            page = replace(page, next=None)
        pages = queries.pages(listed.source, page, database_filter)
        body = file_parts(listed, pages, form, worker.run)
        attached = f'attachment; filename="{listed.path}.{form}"'
        return StreamingResponse(
            body, 200, {"Content-Disposition": attached}, MEDIA_TYPES[form]
        )


_FILES: dict[str, dict[str, str]] = {
    MEDIA_TYPES["csv"]: {},
    MEDIA_TYPES["ndjson"]: {},
}


def _listing(
    model: Model,
    rows: Sequence[tuple[Any, ...]],
    cursor: Cursor | None,
    now: Sequence[Alert],
) -> Json:
    items: list[Any] = [model(*row) for row in rows]
    if now:
        # An alert of now is in the history, too, in an older state.
        known = {alert.alert_id for alert in now}
        items = [*now, *(row for row in items if row.alert_id not in known)]
    after = None if cursor is None else lists.write_cursor(cursor)
    return Json({"items": items, "next": after})


async def file_parts(
    listed: HistoryList[R],
    pages: AsyncIterator[Sequence[R]],
    form: Form,
    run: Callable[..., Awaitable[bytes]],
) -> AsyncIterator[bytes]:
    """A list as a file, a part for each page, which ``run`` writes outside the loop."""
    has_head = form == "csv"
    async for records in pages:
        if form == "csv":
            kind = listed.source.kind
            yield await run(exports.csv_lines, kind, records, has_head=has_head)
            has_head = False
        else:
            rows = await listed.rows(records)
            yield await run(exports.ndjson_rows, listed.shape.from_record, rows)
