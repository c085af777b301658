"""The history over HTTP: lists to filter and export, and figures.

Lists answer JSON, CSV or NDJSON, as ``Accept`` or ``format`` says.
"""

from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from secrets import token_hex
from typing import Annotated, Any, Generic, Literal, TypeVar

from fastapi import APIRouter, Depends, HTTPException, Path, Query, Request, Response
from fastapi.responses import StreamingResponse
from orjson import Fragment

from iveg.adapters import clock
from iveg.adapters.extras import require_extra
from iveg.adapters.history import cursors, listings, lists
from iveg.adapters.history.listings import ListOf
from iveg.adapters.history.lists import Filter, Page
from iveg.adapters.history.queries import Queries
from iveg.adapters.parquet import parquet_end, parquet_page
from iveg.domain.alerts.flood import FloodState as NoFlood
from iveg.domain.errors import MissingExtraError
from iveg.domain.fleet import NOBODY, FleetDescription
from iveg.domain.records import CommandRecord, DecisionRecord, Record
from iveg.models.alert import Alert, AlertListing, Flood
from iveg.models.audit import AuditEntry
from iveg.models.base import Listing, Model, write_json
from iveg.models.command import Command
from iveg.models.decision import Decision
from iveg.models.detection import DetectionRow
from iveg.models.dictionary import DictionaryColumn, dictionary_columns
from iveg.models.equipment import Measurement
from iveg.models.log_entry import LogEntry
from iveg.models.odometry import OdometryRow
from iveg.models.reading import Reading
from iveg.pipeline.ports import Clock
from iveg.web.api import exports, figures
from iveg.web.api.answers import FEW_ROWS, Apart, Json
from iveg.web.api.exports import MEDIA_TYPES, Form
from iveg.web.api.history_filters import Filters, filter_of
from iveg.web.pages.local_time import in_madrid
from iveg.web.pages.sentences import Sentences
from iveg.web.pages.translations import read_translations
from iveg.web.refusals import refusals
from iveg.web.security.authentication import Action, require

R = TypeVar("R", bound=Record)
_DAY_S = 86_400.0
_FOR_GOOD = "public, max-age=31536000, immutable"
FileForm = Form | Literal["parquet"]
_PARQUET = "application/vnd.apache.parquet"
_FILES: dict[str, dict[str, str]] = {
    MEDIA_TYPES["csv"]: {},
    MEDIA_TYPES["ndjson"]: {},
    _PARQUET: {},
}


@dataclass(frozen=True, slots=True)
class HistoryList(Generic[R]):
    """One list: its source and its models; ``more`` stands beside it.

    Attributes:
        model: Of a row, and of what ``beside`` found for it.
        beside: Other rows that the models of some rows need, in their order.
        needs: What whoever asks must be allowed.
    """

    path: str
    of: ListOf[R]
    model: Callable[..., Model]
    listing: type[Listing[Any]]
    says: str
    more: Callable[[], dict[str, Any]] = dict
    beside: Callable[[Sequence[R]], Awaitable[list[Any]]] | None = None
    needs: Action = "read"

    async def rows(self, records: Sequence[R]) -> list[tuple[Any, ...]]:
        """What ``model`` is called with, for each record."""
        if self.beside is None:
            return [(one,) for one in records]
        return list(zip(records, await self.beside(records), strict=True))


_MEASURED: tuple[HistoryList[Any], ...] = (
    HistoryList(
        "detections",
        listings.DETECTIONS,
        DetectionRow.of_row,
        Listing[DetectionRow],
        "What robots saw, by when it reached iVeg",
    ),
    HistoryList(
        "tracks",
        listings.TRACKS,
        DetectionRow.of_row,
        Listing[DetectionRow],
        "Where people were: their detections, by when each reached iVeg",
    ),
    HistoryList(
        "odometry",
        listings.ODOMETRY,
        OdometryRow.of_record,
        Listing[OdometryRow],
        "Poses and speeds of robots with their speed limits, twice a second",
    ),
    HistoryList(
        "readings",
        listings.READINGS,
        Reading.of_record,
        Listing[Reading],
        "What small sensors of robots said; `class` asks for a kind, as `battery`",
    ),
    HistoryList(
        "measurements",
        listings.MEASUREMENTS,
        Measurement.of_record,
        Listing[Measurement],
        "Numbers of other equipment; `class` asks for an entity or an attribute",
    ),
)
"""What was measured; each column of the CSV is a key of the JSON."""


def router(
    queries: Queries,
    worker: Apart,
    *,
    threshold: Callable[[], float | None] = lambda: None,
    present: Callable[[str], DecisionRecord | None] = lambda _: None,
    flood: Callable[[], Flood] = lambda: Flood.of(NoFlood()),
    fleet: FleetDescription = NOBODY,
    read_clock: Clock = clock.now,
) -> APIRouter:
    """The routes of the history.

    Args:
        queries: Where the past is asked for.
        worker: Where files are written and figures drawn.
        threshold: Least confidence of the rule in force, marked in the chart.
        present: A decision that is still in memory; its links are those of now.
        flood: How fast alerts come.
        fleet: Whose greatest speeds the chart is about.
        read_clock: What "the last 15 minutes" end at.
    """
    routes = APIRouter(
        dependencies=[Depends(require("read"))],
        tags=["history"],
        responses=refusals(503),
    )
    for one in lists_of(queries, flood):
        _add_list(routes, queries, one, worker)

    @routes.get(
        "/api/v1/decisions/{decision_id}",
        summary="One decision",
        response_model=Decision,
    )
    async def decision(
        decision_id: Annotated[str, Path(pattern=r"^[ -~]{1,64}$")],
    ) -> Response:
        found = present(decision_id) or await queries.one(
            listings.DECISIONS, decision_id
        )
        if found is None:
            raise HTTPException(404, "There is no such decision.")
        return Json(Decision.of_record(found))

    @routes.get(
        "/api/v1/exports/dictionary",
        summary="What each column of an exported list means",
        response_model=Listing[DictionaryColumn],
    )
    async def dictionary() -> Listing[DictionaryColumn]:
        return Listing(items=dictionary_columns())

    figures.add_routes(routes, queries, worker, threshold, fleet, read_clock)
    return routes


def lists_of(
    queries: Queries, flood: Callable[[], Flood] = lambda: Flood.of(NoFlood())
) -> tuple[HistoryList[Any], ...]:
    """All lists of the history."""

    async def steps_of(records: Sequence[CommandRecord]) -> list[Any]:
        steps = await queries.steps_of([one.command_id for one in records])
        return [steps.get(one.command_id, ()) for one in records]

    return (
        HistoryList(
            "decisions",
            listings.DECISIONS,
            Decision.of_record,
            Listing[Decision],
            "Why robots were slowed, by when it began",
        ),
        HistoryList(
            "commands",
            listings.COMMANDS,
            Command.of_record,
            Listing[Command],
            "Every STOP, release and resume, by when it was asked",
            beside=steps_of,
        ),
        HistoryList(
            "alerts",
            listings.ALERTS,
            Alert.of_record,
            AlertListing,
            "Every alert, by when it was last raised, and how fast they come",
            lambda: {"flood": flood()},
        ),
        HistoryList(
            "log",
            listings.LOG,
            LogEntry.of_record,
            Listing[LogEntry],
            "The action and inference log",
        ),
        HistoryList(
            "audit",
            listings.AUDIT,
            AuditEntry.of_record,
            Listing[AuditEntry],
            "Who did what; `robot` asks for a subject, `class` for an action or name",
            needs="release",
        ),
        *_MEASURED,
    )


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
        if form == "json":
            return await _listing(await queries.page(one.of, asked), one, worker)
        return await _file(queries, one, filters, asked, form, worker)


async def _listing(page: Page[R], one: HistoryList[R], worker: Apart) -> Response:
    after = None if page.next is None else cursors.write_cursor(page.next)
    rows = await one.rows(page.items)
    if len(rows) <= FEW_ROWS:
        items = [one.model(*row) for row in rows]
        return Json(one.listing(items=items, next=after, **one.more()))
    items_json = Fragment(await worker.run(_write_items, one.model, rows))
    return Json({"items": items_json, "next": after, **one.more()})


def _write_items(model: Callable[..., Model], rows: Sequence[tuple[Any, ...]]) -> bytes:
    return write_json([model(*row) for row in rows])


async def _file(
    queries: Queries,
    one: HistoryList[R],
    filters: Filters,
    asked: Filter,
    form: FileForm,
    worker: Apart,
) -> Response:
    """A whole list as a file; with a limit, that many rows of it."""
    if form == "parquet":
        _require_parquet()
    if filters.limit is None:
        asked = replace(asked, limit=lists.MOST_ROWS)
    # The first page is read before the answer begins, so that a refusal can be told.
    first = await queries.page(one.of, asked)
    if filters.limit is not None:
        first = replace(first, next=None)
    pages = queries.pages(one.of, first, asked)
    if form == "parquet":
        body = _parquet(one.path, pages, worker)
    elif form == "csv":
        body = _csv(one.of.kind, pages, filters.language, worker)
    else:
        body = _ndjson(one, pages, worker)
    name = f"{one.path}{_day(asked) if filters.language else ''}.{form}"
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    media_type = _PARQUET if form == "parquet" else MEDIA_TYPES[form]
    return StreamingResponse(body, 200, headers, media_type)


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


def _require_parquet() -> None:
    try:
        require_extra("parquet", "an export as Parquet")
    except MissingExtraError as error:
        raise HTTPException(501, str(error)) from error


async def _parquet(
    name: str, pages: AsyncIterator[Sequence[Record]], worker: Apart
) -> AsyncIterator[bytes]:
    key, number = token_hex(8), 0
    async for records in pages:
        yield await worker.run(parquet_page, key, name, number, records)
        number += 1
    yield await worker.run(parquet_end, key, number)


@cache
def _reader(language: str | None) -> Sentences | None:
    return None if language is None else Sentences(read_translations(language))


def _day(asked: Filter) -> str:
    """The first day that was asked for, for the name of the file."""
    at = clock.wall() if asked.since is None else asked.since
    return f"-{in_madrid(at):%Y-%m-%d}"
