"""Summaries of the history over HTTP: figures, orders, the evening sheet."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from contextlib import closing
from datetime import date, timedelta
from typing import Annotated, Any

from fastapi import APIRouter, Depends, HTTPException, Path, Query, Request, Response
from orjson import Fragment

from iveg.adapters.history.lists import (
    COMMANDS,
    DECISIONS,
    MOST_ROWS,
    STOPS,
    Filter,
    ListOf,
    R,
)
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import (
    AIR,
    EQUIPMENT,
    SPEEDS,
    people_seen,
    poses_of,
    series_of,
)
from iveg.adapters.history.upkeep import lost_of
from iveg.domain.alerts import MOST_KEPT
from iveg.domain.day import (
    closest_passes,
    encounter_counts,
    slowed_minutes,
    worked_minutes,
)
from iveg.domain.errors import HopError
from iveg.domain.fleet import FleetDescription, as_counted
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.base import GreenhouseMap, write_json
from iveg.models.command import Command
from iveg.models.history import Day, Encounters, Pass, Slowed, Worked
from iveg.vital.ports import Clock
from iveg.web.api.answers import Apart, Json
from iveg.web.api.exports import MEDIA_TYPES
from iveg.web.api.history_filters import HistoryDay, Range, Span, range_of
from iveg.web.pages import charts
from iveg.web.pages.drawing import Pages
from iveg.web.pages.sentences import in_madrid, start_of
from iveg.web.security.requirements import require

_DAY_S = 86_400.0
_FIGURES: dict[str, Any] = {
    "response_class": Response,
    "responses": {200: {"content": {"application/json": {}}}},
}
"""Said of each route of figures."""


def add_routes(
    routes: APIRouter,
    queries: Queries,
    worker: Apart,
    fleet: FleetDescription,
    read_clock: Clock,
) -> None:
    """Add the figures to the routes of the history, whose arguments these are."""

    async def figures(
        draw: Callable[..., Mapping[str, bytes]],
        since: float,
        until: float,
        *facts: object,
    ) -> Response:
        body = await worker.run(_write_figures, draw, since, until, *facts)
        return Response(body, media_type=MEDIA_TYPES["json"])

    @routes.get(
        "/api/v1/history/charts",
        summary="Plotly figures of a range",
        description="Speed with the speed limit; the last 15 minutes unless told.",
        **_FIGURES,
    )
    async def charted(asked: Annotated[Range, Query()]) -> Response:
        since, until = range_of(asked, read_clock().wall)
        found = await queries.ask(series_of, SPEEDS, since, until, asked.robot)
        return await figures(charts.history_figures, since, until, found, fleet)

    @routes.get(
        "/api/v1/history/climate",
        summary="The air over a range",
        description="Plotly figures of readings, or of their means over slices of "
        "time; the last 24 hours unless told.",
        **_FIGURES,
    )
    async def climate(asked: Annotated[Span, Query()]) -> Response:
        since, until = range_of(asked, read_clock().wall, _DAY_S)
        found = await queries.ask(series_of, AIR, since, until)
        return await figures(charts.climate_figures, since, until, found)

    @routes.get(
        "/api/v1/history/equipment",
        summary="Other equipment over a range",
        description="A Plotly figure of each attribute that was heard, by entity and "
        "attribute; the last 24 hours unless told.",
        **_FIGURES,
    )
    async def equipment(asked: Annotated[Span, Query()]) -> Response:
        since, until = range_of(asked, read_clock().wall, _DAY_S)
        found = await queries.ask(series_of, EQUIPMENT, since, until)
        return await figures(charts.equipment_figures, since, until, found)


def _write_figures(
    draw: Callable[..., Mapping[str, bytes]],
    since: float,
    until: float,
    *facts: object,
) -> bytes:
    drawn = draw(*facts)
    return write_json(
        {
            "since": format_stamp(since),
            "until": format_stamp(until),
            "figures": {name: Fragment(figure) for name, figure in drawn.items()},
        }
    )


def stop_records_router(
    queries: Queries,
    clock: Clock,
    find: Callable[[str, Instant], Command | None],
) -> APIRouter:
    """Routes of past STOPs; ``find`` knows the commands of this run."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["commands"],
        dependencies=[Depends(require("read"))],
    )

    @routes.get("/commands/{command_id}", response_model=Command)
    async def command(
        command_id: Annotated[str, Path(pattern=r"^[ -~]{1,64}$")],
    ) -> Response:
        """One command: as it stands, with what the history knows of it."""
        followed = find(command_id, clock())
        try:
            kept = await _kept(queries, command_id)
        except HopError:
            if followed is None:
                raise
            kept = None
        if followed is None and kept is None:
            raise HTTPException(404, "There is no such command.")
        return Json(_joined(followed, kept))

    return routes


async def _kept(queries: Queries, command_id: str) -> Command | None:
    found = await queries.one(COMMANDS, command_id)
    if found is None:
        return None
    steps = await queries.steps_of([command_id])
    return Command.from_record(found, steps.get(command_id, ()))


def _joined(followed: Command | None, kept: Command | None) -> Command | None:
    """Join a command of now with what only the history tells: outcome and steps."""
    if followed is None or kept is None:
        return followed or kept
    ended = {"outcome": kept.outcome, "was_loud": kept.was_loud, "steps": kept.steps}
    return followed.model_copy(update=ended)


_DAY = timedelta(days=1)
_MOST_RECORDS = 20 * MOST_ROWS
"""So many are read; a day with more is told by those."""
ReadDay = Callable[[date, float], Awaitable[Day]]
"""Has one day read from the history, as far as it has gone (Unix s)."""


def read_day(url: str, greenhouse: Greenhouse, day: date, now: float) -> Day:
    """One day of a history up to ``now`` (Unix s); takes seconds."""

    async def read() -> Day:
        with closing(Queries(url)) as queries:
            return await _read(queries, greenhouse, day, now)

    return asyncio.run(read())


async def _read(queries: Queries, greenhouse: Greenhouse, day: date, now: float) -> Day:
    since, end = start_of(day), start_of(day + _DAY)
    until = max(since, min(end, now))
    poses = await queries.ask(poses_of, since, until)
    seen = await queries.ask(people_seen, since, until)
    decisions = await _newest(queries, DECISIONS, since, until)
    stops = await _newest(queries, STOPS, since, until)
    slowed = slowed_minutes(decisions, greenhouse, until)
    by_name = [
        Worked(lane=lane, robot_id=robot, minutes=robots[robot])
        for lane, robots in worked_minutes(poses, greenhouse).items()
        for robot in sorted(robots, key=as_counted)
    ]
    by_length = [
        Slowed(cause=cause, lane=lane, minutes=minutes)
        for (cause, lane), minutes in sorted(slowed.items(), key=lambda one: -one[1])
    ]
    return Day(
        day=day.isoformat(),
        since=format_stamp(since),
        until=format_stamp(until),
        robots=sorted({pose.robot_id for pose in poses}, key=as_counted),
        worked=by_name,
        slowed=by_length,
        encounters=Encounters.from_value(encounter_counts(decisions)),
        passes=[
            Pass.from_value(one) for one in closest_passes(poses, seen, greenhouse)
        ],
        stops=[Command.from_record(one) for one in reversed(stops)],
        unseen=len(await queries.unseen_alerts(MOST_KEPT)),
        lost=list(await queries.ask(lost_of, since, until)),
        map=GreenhouseMap.of(greenhouse),
    )


async def _newest(
    queries: Queries, listed: ListOf[R], since: float, until: float
) -> list[R]:
    """The newest rows of a range, newest first."""
    wanted = Filter(since=since, until=until, limit=MOST_ROWS)
    pages = queries.pages(listed, await queries.page(listed, wanted), wanted)
    found: list[R] = []
    async for page in pages:
        found += page
        if len(found) >= _MOST_RECORDS:
            break
    return found


def router(read: ReadDay, pages: Pages, clock: Clock) -> APIRouter:
    """The evening sheet."""
    routes = APIRouter()
    who = Depends(require("read"))

    @routes.get(
        "/api/v1/day",
        response_model=Day,
        dependencies=[who],
        tags=["history"],
    )
    async def numbers(
        day: Annotated[
            HistoryDay | None, Query(description="Today unless told")
        ] = None,
    ) -> Response:
        """Summary of one day of the fleet, Europe/Madrid, and what is due next."""
        now = clock().wall
        return Json(await read(day or in_madrid(now).date(), now))

    @routes.get("/day", response_model=None, include_in_schema=False)
    async def sheet(
        request: Request,
        visitor: Annotated[Any, who],
        day: Annotated[HistoryDay | None, Query()] = None,
    ) -> Response:
        now = clock().wall
        wanted = day or in_madrid(now).date()
        found = await read(wanted, now)
        before, after = ((wanted + step).isoformat() for step in (-_DAY, _DAY))
        frame = pages.frame(request, "day", visitor)
        # The first drawing also reads the template.
        return await asyncio.to_thread(
            pages.draw, frame, day=found, before=before, after=after
        )

    return routes
