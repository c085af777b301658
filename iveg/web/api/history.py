"""The history over HTTP: lists to filter and export, and figures.

Lists answer JSON, CSV or NDJSON, as ``Accept`` or ``format`` says.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Generic, TypeVar

from fastapi import APIRouter, Depends, HTTPException, Path, Query, Request, Response
from fastapi.responses import StreamingResponse

from iveg.adapters import clock
from iveg.adapters.history import lists
from iveg.adapters.history.lists import Cursor, ListOf, Page
from iveg.adapters.history.queries import Queries
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
from iveg.web.api.answers import Apart, Json
from iveg.web.api.exports import MEDIA_TYPES, Form
from iveg.web.api.history_filters import Filters, filter_of
from iveg.web.security.requirements import require
from iveg.web.security.roles import Action

R = TypeVar("R", bound=Record)
Model = Callable[..., Row]


@dataclass(frozen=True, slots=True)
class HistoryList(Generic[R]):
    """One list: its source and its models.

    Attributes:
        shape: Model of a row.
        beside: Other rows that the models of some rows need, in their order.
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
            return [(one,) for one in records]
        return list(zip(records, await self.beside(records), strict=True))


def lists_of(
    queries: Queries, alerts: Callable[[], list[Alert]] = list
) -> tuple[HistoryList[Any], ...]:
    """All lists of the history."""

    async def steps_of(records: Sequence[CommandRecord]) -> list[Any]:
        steps = await queries.steps_of([one.command_id for one in records])
        return [steps.get(one.command_id, ()) for one in records]

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
    worker: Apart,
    *,
    present: Callable[[str], DecisionRecord | None] = lambda _: None,
    alerts: Callable[[], list[Alert]] = list,
    fleet: FleetDescription = NOBODY,
    read_clock: Clock = clock.now,
) -> APIRouter:
    """The routes of the history.

    Args:
        queries: Reading side of the history.
        worker: Writes files and draws figures.
        present: A decision that is still in memory; its links are those of now.
        alerts: Those of now.
        fleet: Robots, whose greatest speeds a chart shows.
        read_clock: What "the last 15 minutes" end at.
    """
    routes = APIRouter(
        dependencies=[Depends(require("read"))],
        tags=["history"],
    )
    for one in lists_of(queries, alerts):
        _add_list(routes, queries, one, worker)

    @routes.get(
        "/api/v1/decisions/{decision_id}",
        summary="One decision",
        response_model=Decision,
    )
    async def decision(
        decision_id: Annotated[str, Path(pattern=r"^[ -~]{1,64}$")],
    ) -> Response:
        found = present(decision_id) or await queries.one(lists.DECISIONS, decision_id)
        if found is None:
            raise HTTPException(404, "There is no such decision.")
        return Json(Decision.from_record(found))

    day.add_routes(routes, queries, worker, fleet, read_clock)
    return routes


def _add_list(
    routes: APIRouter, queries: Queries, one: HistoryList[R], worker: Apart
) -> None:
    @routes.get(
        f"/api/v1/{one.path}",
        name=one.path,
        summary=one.says,
        response_model=Listing[one.shape],  # type: ignore[name-defined]
        responses={200: {"content": _FILES}},
        dependencies=[Depends(require(one.needs))],
    )
    async def listing(
        request: Request, filters: Annotated[Filters, Query()]
    ) -> Response:
        form = filters.format or exports.form_of(request.headers)
        wanted = filter_of(filters, one.source)
        if form != "json" and filters.limit is None:
            wanted = replace(wanted, limit=lists.MOST_ROWS)
        # The first page is read before the answer begins, so that a refusal is told.
        is_plain = form == "json" and filters.model_fields_set <= {"limit", "format"}
        now = one.present() if is_plain else []
        try:
            page = await queries.page(one.source, wanted)
        except HopError:
            if not now:
                raise
            page = Page((), None)
        if form == "json":
            rows = await one.rows(page.items)
            model = one.shape.from_record
            return await asyncio.to_thread(_listing, model, rows, page.next, now)
        if filters.limit is not None:
            page = replace(page, next=None)
        pages = queries.pages(one.source, page, wanted)
        body = file_parts(one, pages, form, worker.run)
        attached = f'attachment; filename="{one.path}.{form}"'
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
        known = {one.alert_id for one in now}
        items = [*now, *(one for one in items if one.alert_id not in known)]
    after = None if cursor is None else lists.write_cursor(cursor)
    return Json({"items": items, "next": after})


async def file_parts(
    one: HistoryList[R],
    pages: AsyncIterator[Sequence[R]],
    form: Form,
    run: Callable[..., Awaitable[bytes]],
) -> AsyncIterator[bytes]:
    """A list as a file, a part for each page; ``run`` has a part written elsewhere."""
    has_head = form == "csv"
    async for records in pages:
        if form == "csv":
            kind = one.source.kind
            yield await run(_csv_page, kind, records, has_head=has_head)
            has_head = False
        else:
            rows = await one.rows(records)
            yield await run(exports.ndjson_rows, one.shape.from_record, rows)


def _csv_page(kind: type[R], records: Sequence[R], *, has_head: bool) -> bytes:
    head = exports.csv_head(kind) if has_head else b""
    return head + exports.csv_rows(kind, records)
