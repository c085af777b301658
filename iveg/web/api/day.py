"""Summaries of the history over HTTP: figures, orders, the evening sheet."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from contextlib import closing
from datetime import date, timedelta
from typing import Annotated, Any

from fastapi import APIRouter, HTTPException, Query, Request, Response
from orjson import Fragment

from iveg.adapters.history.lists import (
    COMMANDS,
    DECISIONS,
    MOST_ROWS,
    STOPS,
    Filter,
)
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import (
    AIR,
    EQUIPMENT,
    SPEEDS,
    Charted,
    people_seen,
    poses_of,
    series_of,
)
from iveg.adapters.worker import Worker
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
from iveg.domain.retention import DAY_S
from iveg.domain.stamps import format_stamp
from iveg.models.base import GreenhouseMap, write_json
from iveg.models.command import Command
from iveg.models.history import Day, Encounters, Pass, Slowed, Worked
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.exports import MEDIA_TYPES
from iveg.web.api.history_filters import (
    USUAL_RANGE_S,
    HistoryDay,
    Range,
    RecordId,
    Span,
    range_of,
)
from iveg.web.pages import charts
from iveg.web.pages.drawing import Pages
from iveg.web.pages.sentences import in_madrid, start_of
from iveg.web.security.requirements import READERS, Reader

_FIGURES: dict[str, Any] = {
    "response_class": Response,
    "responses": {200: {"content": {"application/json": {}}}},
}
"""OpenAPI of each route of figures."""


def add_routes(
    routes: APIRouter,
    queries: Queries,
    worker: Worker,
    fleet: FleetDescription,
    read_clock: Clock,
) -> None:
    """Add the routes of figures; the arguments are those of the history's routes."""

    async def figures(
        span: Span,
        usual_s: float,
        rows: Charted,
        draw: Callable[..., Mapping[str, bytes]],
        *facts: object,
        robot: str | None = None,
    ) -> Response:
        since, until = range_of(span, read_clock().wall, usual_s)
        series = await queries.ask(series_of, rows, since, until, robot)
        # Plotly takes too long for the loop, in which a STOP waits.
        body = await worker.run(_write_figures, draw, since, until, series, *facts)
        return Response(body, media_type=MEDIA_TYPES["json"])

    @routes.get(
        "/api/v1/history/charts",
        summary="Plotly figures of a range",
        description="Speed with the speed limit; the last 15 minutes unless told.",
        **_FIGURES,
    )
    async def charted(span: Annotated[Range, Query()]) -> Response:
        return await figures(
            span,
            USUAL_RANGE_S,
            SPEEDS,
            charts.history_figures,
            fleet,
            robot=span.robot,
        )

    @routes.get(
        "/api/v1/history/climate",
        summary="The air over a range",
        description="Plotly figures of readings, or of their means over slices of "
        "time; the last 24 hours unless told.",
        **_FIGURES,
    )
    async def climate(span: Annotated[Span, Query()]) -> Response:
        return await figures(span, DAY_S, AIR, charts.climate_figures)

    @routes.get(
        "/api/v1/history/equipment",
        summary="Other equipment over a range",
        description="A Plotly figure of each attribute that was heard, by entity and "
        "attribute; the last 24 hours unless told.",
        **_FIGURES,
    )
    async def equipment(span: Annotated[Span, Query()]) -> Response:
        return await figures(span, DAY_S, EQUIPMENT, charts.equipment_figures)


def _write_figures(
    draw: Callable[..., Mapping[str, bytes]],
    since: float,
    until: float,
    *facts: object,
) -> bytes:
    figures = draw(*facts)
    return write_json(
        {
            "since": format_stamp(since),
            "until": format_stamp(until),
            "figures": {name: Fragment(figure) for name, figure in figures.items()},
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
        dependencies=READERS,
    )

    @routes.get("/commands/{command_id}", response_model=Command)
    async def command(
        command_id: RecordId,
    ) -> Response:
        """One command in its present state, with its rows of the history."""
        followed = find(command_id, clock())
        try:
            stored = await _kept(queries, command_id)
        except HopError:
            # A command of this run is known without the database.
            if followed is None:
                raise
            stored = None
        if followed is None and stored is None:
            raise HTTPException(404, "There is no such command.")
        return Json(_joined(followed, stored))

    return routes


async def _kept(queries: Queries, command_id: str) -> Command | None:
    record = await queries.get(COMMANDS, command_id)
    if record is None:
        return None
    steps = await queries.steps_of([command_id])
    return Command.from_record(record, steps.get(command_id, ()))


def _joined(followed: Command | None, kept: Command | None) -> Command | None:
    """A followed command with outcome and steps of the history."""
    if followed is None or kept is None:
        return followed or kept
    outcome = {"outcome": kept.outcome, "was_loud": kept.was_loud, "steps": kept.steps}
    return followed.model_copy(update=outcome)


_DAY = timedelta(days=1)
_MOST_RECORDS = 20 * MOST_ROWS
"""Rows of a list that are read; a longer day is summed up by these."""
ReadDay = Callable[[date, float], Awaitable[Day]]
"""Reads one day from the history, up to a moment (Unix s)."""


def read_day(url: str, greenhouse: Greenhouse, day: date, now: float) -> Day:
    """Summary of one day up to ``now`` (Unix s); takes seconds, so it runs apart."""

    async def read() -> Day:
        # The worker is a process of its own and shares no connection.
        with closing(Queries(url)) as queries:
            return await _read(queries, greenhouse, day, now)

    return asyncio.run(read())


async def _read(queries: Queries, greenhouse: Greenhouse, day: date, now: float) -> Day:
    since, end = start_of(day), start_of(day + _DAY)
    # A future day is empty, and today ends now.
    until = max(since, min(end, now))
    poses = await queries.ask(poses_of, since, until)
    sightings = await queries.ask(people_seen, since, until)
    span = Filter(since=since, until=until, limit=MOST_ROWS)
    decisions = await queries.rows(DECISIONS, span, _MOST_RECORDS)
    stops = await queries.rows(STOPS, span, _MOST_RECORDS)
    # An open slow-down counts up to the end of the range.
    slowed = slowed_minutes(decisions, greenhouse, until)
    by_name = [
        Worked(lane=lane, robot_id=robot, minutes=robots[robot])
        for lane, robots in worked_minutes(poses, greenhouse).items()
        for robot in sorted(robots, key=as_counted)
    ]
    by_length = [
        Slowed(cause=cause, lane=lane, minutes=minutes)
        for (cause, lane), minutes in sorted(slowed.items(), key=lambda row: -row[1])
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
            Pass.from_value(passing)
            for passing in closest_passes(poses, sightings, greenhouse)
        ],
        stops=[Command.from_record(stop) for stop in reversed(stops)],
        unseen=len(await queries.unseen_alerts()),
        map=GreenhouseMap.from_greenhouse(greenhouse),
    )


def router(read: ReadDay, pages: Pages, clock: Clock) -> APIRouter:
    """The evening sheet."""
    routes = APIRouter()

    @routes.get(
        "/api/v1/day",
        response_model=Day,
        dependencies=READERS,
        tags=["history"],
    )
    async def numbers(
        day: Annotated[
            HistoryDay | None, Query(description="Today unless told")
        ] = None,
    ) -> Response:
        """Summary of one day of the fleet, Europe/Madrid, and tasks due next."""
        now = clock().wall
        return Json(await read(day or in_madrid(now).date(), now))

    @routes.get("/day", response_model=None, include_in_schema=False)
    async def sheet(
        request: Request,
        visitor: Reader,
        day: Annotated[HistoryDay | None, Query()] = None,
    ) -> Response:
        now = clock().wall
        chosen_day = day or in_madrid(now).date()
        summary = await read(chosen_day, now)
        before, after = ((chosen_day + step).isoformat() for step in (-_DAY, _DAY))
        frame = pages.frame(request, "day", visitor)
        # The first drawing also reads the template.
        return await asyncio.to_thread(
            pages.draw, frame, day=summary, before=before, after=after
        )

    return routes
