"""The history over HTTP: lists to filter and export, and figures.

Lists answer JSON, CSV or NDJSON, as ``Accept`` or ``format`` says.
"""

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, Generic, TypeVar

from fastapi import APIRouter, Depends, HTTPException, Path, Query, Request, Response
from fastapi.responses import StreamingResponse
from orjson import Fragment

from iveg.adapters import clock
from iveg.adapters.history import lists
from iveg.adapters.history.lists import Filter, ListOf, Page
from iveg.adapters.history.queries import Queries
from iveg.domain.errors import HopError
from iveg.domain.fleet import NOBODY, FleetDescription
from iveg.domain.records import CommandRecord, DecisionRecord, Record
from iveg.models.base import Listing, Row, write_json
from iveg.models.command import Command
from iveg.models.dictionary import DictionaryColumn, dictionary_columns
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
from iveg.web.api.answers import FEW_ROWS, Apart, Json
from iveg.web.api.exports import MEDIA_TYPES, Form
from iveg.web.api.history_filters import Filters, filter_of
from iveg.web.pages.sentences import Sentences, in_madrid, read_sentences
from iveg.web.security.requirements import refusals, require
from iveg.web.security.roles import Action

R = TypeVar("R", bound=Record)


@dataclass(frozen=True, slots=True)
class HistoryList(Generic[R]):
    """One list: its source and its models.

    Attributes:
        shape: Model of a row.
        beside: Other rows that the models of some rows need, in their order.
        needs: What whoever asks must be allowed.
        of_now: Those of this moment, which no database has to be asked for.
    """

    path: str
    of: ListOf[R]
    shape: type[Row]
    says: str
    beside: Callable[[Sequence[R]], Awaitable[list[Any]]] | None = None
    needs: Action = "read"
    of_now: Callable[[], list[Alert]] | None = None

    @property
    def model(self) -> Callable[..., Row]:
        """Makes the model of a row, and of what ``beside`` found for it."""
        return self.shape.from_record

    @property
    def listing(self) -> type[Listing[Any]]:
        """A page of it."""
        return Listing[self.shape]  # type: ignore[name-defined]

    async def rows(self, records: Sequence[R]) -> list[tuple[Any, ...]]:
        """Arguments of ``model``, for each record."""
        if self.beside is None:
            return [(one,) for one in records]
        return list(zip(records, await self.beside(records), strict=True))


def lists_of(
    queries: Queries,
    alerts_of_now: Callable[[], list[Alert]] = list,
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
            of_now=alerts_of_now,
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


_FILES: dict[str, dict[str, str]] = {
    MEDIA_TYPES["csv"]: {},
    MEDIA_TYPES["ndjson"]: {},
}


def router(
    queries: Queries,
    worker: Apart,
    *,
    threshold: Callable[[], float | None] = lambda: None,
    present: Callable[[str], DecisionRecord | None] = lambda _: None,
    alerts: Callable[[], list[Alert]] = list,
    fleet: FleetDescription = NOBODY,
    read_clock: Clock = clock.now,
) -> APIRouter:
    """The routes of the history.

    Args:
        queries: Where the past is asked for.
        worker: Where files are written and figures drawn.
        threshold: Least confidence of the rule in force, marked in the chart.
        present: A decision that is still in memory; its links are those of now.
        alerts: Those of now.
        fleet: Whose greatest speeds the chart is about.
        read_clock: What "the last 15 minutes" end at.
    """
    routes = APIRouter(
        dependencies=[Depends(require("read"))],
        tags=["history"],
        responses=refusals(503),
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

    @routes.get(
        "/api/v1/exports/dictionary",
        summary="What each column of an exported list means",
        response_model=Listing[DictionaryColumn],
    )
    async def dictionary() -> Listing[DictionaryColumn]:
        return Listing(items=dictionary_columns())

    day.add_routes(routes, queries, worker, threshold, fleet, read_clock)
    return routes


def _add_list(
    routes: APIRouter, queries: Queries, one: HistoryList[R], worker: Apart
) -> None:
    @routes.get(
        f"/api/v1/{one.path}",
        name=one.path,
        summary=one.says,
        response_model=one.listing,
        responses={200: {"content": _FILES}, **refusals(501)},
        dependencies=[Depends(require(one.needs))],
    )
    async def listing(
        request: Request, filters: Annotated[Filters, Query()]
    ) -> Response:
        form = filters.format or exports.form_of(request.headers)
        asked = filter_of(filters, one.of)
        if one.of_now is not None and form == "json" and _is_plain(asked):
            return await _with_now(queries, one, asked, one.of_now())
        if form == "json":
            return await _listing(await queries.page(one.of, asked), one, worker)
        return await _file(queries, one, filters, asked, form, worker)


def _is_plain(asked: Filter) -> bool:
    return replace(asked, limit=lists.USUAL_ROWS) == Filter()


async def _with_now(
    queries: Queries, one: HistoryList[R], asked: Filter, now: list[Alert]
) -> Response:
    """The newest page, with what memory knows better; alone where nothing else does."""
    page: Page[R] = Page((), None)
    with suppress(HopError):
        page = await queries.page(one.of, asked)
    told = {alert.alert_id for alert in now}
    stored = [one.model(*row) for row in await one.rows(page.items)]
    items = [*now, *(alert for alert in stored if alert.alert_id not in told)]
    items.sort(key=lambda alert: alert.last_raised_at, reverse=True)
    after = None if page.next is None else lists.write_cursor(page.next)
    return Json(one.listing(items=items, next=after))


async def _listing(page: Page[R], one: HistoryList[R], worker: Apart) -> Response:
    after = None if page.next is None else lists.write_cursor(page.next)
    rows = await one.rows(page.items)
    if len(rows) <= FEW_ROWS:
        items = [one.model(*row) for row in rows]
        return Json(one.listing(items=items, next=after))
    items_json = Fragment(await worker.run(_write_items, one.model, rows))
    return Json({"items": items_json, "next": after})


def _write_items(model: Callable[..., Row], rows: Sequence[tuple[Any, ...]]) -> bytes:
    return write_json([model(*row) for row in rows])


async def _file(
    queries: Queries,
    one: HistoryList[R],
    filters: Filters,
    asked: Filter,
    form: Form,
    worker: Apart,
) -> Response:
    """A whole list as a file; with a limit, that many rows of it."""
    if filters.limit is None:
        asked = replace(asked, limit=lists.MOST_ROWS)
    # The first page is read before the answer begins, so that a refusal can be told.
    first = await queries.page(one.of, asked)
    if filters.limit is not None:
        first = replace(first, next=None)
    pages = queries.pages(one.of, first, asked)
    if form == "csv":
        body = _csv(one.of.kind, pages, filters.language, worker)
    else:
        body = _ndjson(one, pages, worker)
    name = f"{one.path}{_day(asked) if filters.language else ''}.{form}"
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return StreamingResponse(body, 200, headers, MEDIA_TYPES[form])


async def _csv(
    kind: type[R],
    pages: AsyncIterator[Sequence[R]],
    language: str | None,
    worker: Apart,
) -> AsyncIterator[bytes]:
    yield exports.csv_head(kind, _reader(language))
    async for records in pages:
        yield await worker.run(_csv_page, kind, records, language)


def _csv_page(kind: type[R], records: Sequence[R], language: str | None) -> bytes:
    return exports.csv_rows(kind, records, _reader(language))


async def _ndjson(
    one: HistoryList[R], pages: AsyncIterator[Sequence[R]], worker: Apart
) -> AsyncIterator[bytes]:
    async for records in pages:
        yield await worker.run(exports.ndjson_rows, one.model, await one.rows(records))


@cache
def _reader(language: str | None) -> Sentences | None:
    return None if language is None else read_sentences(language)


def _day(asked: Filter) -> str:
    """The first day that was asked for, for the name of the file."""
    at = clock.wall() if asked.since is None else asked.since
    return f"-{in_madrid(at):%Y-%m-%d}"
