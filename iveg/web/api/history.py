"""The history over HTTP: lists to filter and export, and figures.

Lists answer JSON, CSV or NDJSON, as ``Accept`` or ``format`` says.
"""

from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import replace
from functools import cache
from secrets import token_hex
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, HTTPException, Path, Query, Request, Response
from fastapi.responses import StreamingResponse
from orjson import Fragment

from iveg.adapters import clock
from iveg.adapters.extras import require_extra
from iveg.adapters.history import cursors, listings, lists
from iveg.adapters.history.lists import Filter, Page
from iveg.adapters.history.queries import Queries
from iveg.adapters.parquet import parquet_end, parquet_page
from iveg.domain.alerts.flood import FloodState as NoFlood
from iveg.domain.errors import MissingExtraError
from iveg.domain.fleet import NOBODY, FleetDescription
from iveg.domain.records import DecisionRecord, Record
from iveg.models.alert import Flood
from iveg.models.base import Listing, Model, write_json
from iveg.models.decision import Decision
from iveg.models.dictionary import DictionaryColumn, dictionary_columns
from iveg.pipeline.ports import Clock
from iveg.web.api import exports, figures
from iveg.web.api.answers import FEW_ROWS, Apart, Json
from iveg.web.api.exports import MEDIA_TYPES, Form
from iveg.web.api.history_filters import Filters, filter_of
from iveg.web.api.history_lists import HistoryList, R, lists_of
from iveg.web.pages.local_time import in_madrid
from iveg.web.pages.sentences import Sentences
from iveg.web.pages.translations import read_translations
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

FileForm = Form | Literal["parquet"]
_PARQUET = "application/vnd.apache.parquet"
_FILES: dict[str, dict[str, str]] = {
    MEDIA_TYPES["csv"]: {},
    MEDIA_TYPES["ndjson"]: {},
    _PARQUET: {},
}


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
