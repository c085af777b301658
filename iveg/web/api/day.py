"""The evening sheet over HTTP: as numbers, and as a page to print."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import closing
from datetime import date, timedelta
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request, Response

from iveg.adapters.history.ages import lost_of
from iveg.adapters.history.listings import COMMANDS, DECISIONS
from iveg.adapters.history.lists import MOST_ROWS, Filter
from iveg.adapters.history.places import people_seen, poses_of
from iveg.adapters.history.queries import Queries
from iveg.domain.alerts.alert_book import MOST_KEPT
from iveg.domain.day import (
    Passing,
    closest_passes,
    encounter_counts,
    slowed_minutes,
    worked_minutes,
)
from iveg.domain.fleet import as_counted
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.records import CommandRecord, DecisionRecord
from iveg.domain.stamps import format_stamp
from iveg.domain.stop.drills import due_drills
from iveg.models.base import rounded
from iveg.models.command import Command
from iveg.models.day import Day, Encounters, Pass, Slowed, Worked
from iveg.models.places import GreenhouseMap, Point
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.history_filters import HistoryDay
from iveg.web.pages.contexts import DayPage
from iveg.web.pages.drawing import Pages
from iveg.web.pages.local_time import in_madrid, start_of
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

_DAY = timedelta(days=1)
_MOST_PAGES = 20
"""So many pages of rows are read; a day with more is told by those."""
ReadDay = Callable[[date, float], Awaitable[Day]]
"""Has one day read from the history, as far as it has gone (Unix s)."""


def read_day(
    url: str, greenhouse: Greenhouse, drill_days: float, day: date, now: float
) -> Day:
    """One day of a history, as far as it has gone (``now`` in Unix s); takes seconds.

    A STOP drill is due after ``drill_days``; 0: never.
    """

    async def read() -> Day:
        with closing(Queries(url)) as queries:
            return await _read(queries, greenhouse, drill_days, day, now)

    return asyncio.run(read())


async def _read(
    queries: Queries, greenhouse: Greenhouse, drill_days: float, day: date, now: float
) -> Day:
    since, end = start_of(day), start_of(day + _DAY)
    until = max(since, min(end, now))
    poses = await queries.ask(poses_of, since, until)
    seen = await queries.ask(people_seen, since, until)
    worked = worked_minutes(poses, greenhouse)
    decisions = await _decisions(queries, since, until)
    slowed = slowed_minutes(decisions, greenhouse, until)
    met = encounter_counts(decisions)
    last = await queries.last_drills()
    by = start_of(day + 2 * _DAY)
    return Day(
        day=day.isoformat(),
        since=format_stamp(since),
        until=format_stamp(until),
        robots=sorted({pose.robot_id for pose in poses}, key=as_counted),
        worked=[
            Worked(lane=lane, robot_id=robot, minutes=round(minutes, 1))
            for lane, robots in worked.items()
            for robot, minutes in sorted(
                robots.items(), key=lambda one: as_counted(one[0])
            )
        ],
        slowed=[
            Slowed(cause=cause, lane=lane, minutes=round(minutes, 1))
            for (cause, lane), minutes in sorted(
                slowed.items(), key=lambda one: -one[1]
            )
        ],
        encounters=Encounters(
            count=met.count,
            slowed=met.slowed,
            foretold=met.foretold,
            foretold_s=rounded(met.foretold_s, 1),
        ),
        passes=[_pass(one) for one in closest_passes(poses, seen, greenhouse)],
        stops=[Command.of_record(one) for one in await _stops(queries, since, until)],
        drills_due=due_drills(last, drill_days, by),
        unseen=len(await queries.unseen_alerts(MOST_KEPT)),
        lost=list(await queries.ask(lost_of, since, until)),
        map=GreenhouseMap.of(greenhouse),
    )


async def _decisions(
    queries: Queries, since: float, until: float
) -> list[DecisionRecord]:
    asked = Filter(since=since, until=until, limit=MOST_ROWS)
    found: list[DecisionRecord] = []
    for _ in range(_MOST_PAGES):
        page = await queries.page(DECISIONS, asked)
        found += page.items
        if page.next is None:
            break
        asked = Filter(since=since, until=until, limit=MOST_ROWS, cursor=page.next)
    return found


async def _stops(queries: Queries, since: float, until: float) -> list[CommandRecord]:
    asked = Filter(since=since, until=until, limit=MOST_ROWS)
    page = await queries.page(COMMANDS, asked)
    return [one for one in reversed(page.items) if one.kind == "stop"]


def _pass(one: Passing) -> Pass:
    return Pass(
        at=format_stamp(one.at),
        robot_id=one.robot_id,
        distance_m=round(one.distance_m, 2),
        speed=round(one.speed, 2),
        robot=Point(x=round(one.robot[0], 2), y=round(one.robot[1], 2)),
        person=Point(x=round(one.person[0], 2), y=round(one.person[1], 2)),
        lane=one.lane,
    )


def router(read: ReadDay, pages: Pages, clock: Clock) -> APIRouter:
    """The evening sheet."""
    routes = APIRouter()
    who = Depends(require("read"))

    @routes.get(
        "/api/v1/day",
        response_model=Day,
        dependencies=[who],
        tags=["history"],
        responses=refusals(503),
    )
    async def numbers(
        day: Annotated[
            HistoryDay | None, Query(description="Today unless told")
        ] = None,
    ) -> Response:
        """What the fleet did on one day, Europe/Madrid, and what is due next."""
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
        page = DayPage(frame, found, before, after)
        # The first drawing also reads the template.
        return await asyncio.to_thread(pages.draw, page)

    return routes
