"""What a range cost and how near it was: as numbers, and two ranges side by side."""

import asyncio
from collections.abc import Awaitable, Callable, Collection, Mapping
from datetime import UTC, date, datetime, timedelta
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import AfterValidator, BeforeValidator

from iveg.adapters.history.asking import ask_once
from iveg.adapters.history.cost import CostRows, cost_rows
from iveg.domain import cost, near_misses
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.stamps import format_stamp
from iveg.models.base import rounded, stamp
from iveg.models.cost import AlertCount, Cost, Heat, NearMiss, TaskCost
from iveg.models.day import Slowed
from iveg.models.places import GreenhouseMap, Point
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.history_filters import Span, as_kept, mend_plus, range_of
from iveg.web.pages.contexts import ComparePage
from iveg.web.pages.drawing import Pages
from iveg.web.pages.local_time import in_madrid, moment_of, start_of
from iveg.web.security.requirements import require

_DAY_S = 86_400.0
_DAY = timedelta(days=1)
_LEAST_MINUTES = 0.05
_TOLD = (
    *("slowed", "tasks", "near", "near_count", "heat"),
    *("encounters", "encounters_slowed", "alerts", "stops", "drills"),
)


def _in_madrid(moment: datetime) -> datetime:
    """What a form tells has no zone: it is the reader's, Europe/Madrid."""
    as_kept(moment.date())
    if moment.tzinfo:
        return moment
    return datetime.fromtimestamp(moment_of(moment), UTC)


_Told = Annotated[datetime, BeforeValidator(mend_plus), AfterValidator(_in_madrid)]


class _TwoSpans(Span):
    """One range, and another that it is compared with."""

    since: _Told | None = None
    until: _Told | None = None
    than_since: _Told | None = None
    than_until: _Told | None = None


ReadCost = Callable[[float, float], Awaitable[Cost]]
"""Has a range read from the history (Unix s)."""


def read_cost(
    url: str,
    greenhouse: Greenhouse,
    braking: Mapping[str, float],
    since: float,
    until: float,
) -> Cost:
    """One range (Unix s); takes a third of a second for a day of ten robots.

    Margins of each robot count on its ``braking`` (m/s²).
    """
    rows = ask_once(url, cost_rows, since, until, braking)
    return _cost_of(rows, greenhouse, since, until)


def _cost_of(
    rows: CostRows, greenhouse: Greenhouse, since: float, until: float
) -> Cost:
    oldest: Mapping[Literal["places", "telemetry", "events"], float | None] = {
        "places": rows.places_since,
        "telemetry": rows.telemetry_since,
        "events": rows.events_since,
    }
    known = {what for what, at in oldest.items() if at is not None and at < until}
    return Cost(
        since=format_stamp(since),
        until=format_stamp(until),
        lost=[what for what, at in oldest.items() if at is None or at > since],
        places_since=stamp(rows.places_since),
        telemetry_since=stamp(rows.telemetry_since),
        events_since=stamp(rows.events_since),
        **_figures(rows, greenhouse, known),
        cell_m=near_misses.CELL_M,
        map=GreenhouseMap.of(greenhouse),
    )


def _figures(
    rows: CostRows, greenhouse: Greenhouse, known: Collection[str]
) -> dict[str, Any]:
    """What can be told of the range; null, not zero, where it is kept no longer."""
    changes = cost.SpeedChanges(rows.changes)
    figures: dict[str, Any] = dict.fromkeys(_TOLD)
    if "telemetry" in known:
        figures |= _driven(rows, changes, greenhouse)
    if "telemetry" in known and "places" in known:
        figures |= _near(rows, changes, greenhouse)
    if "events" in known:
        figures |= _events(rows)
    return figures


def _driven(
    rows: CostRows,
    changes: cost.SpeedChanges,
    greenhouse: Greenhouse,
) -> dict[str, Any]:
    slowed = cost.slowed_by_aisle(rows.slots, changes, greenhouse)
    tasks = cost.costs(rows.slots, rows.tasks, changes, rows.free_speed)
    return {
        "slowed": [
            Slowed(cause=cause, lane=lane, minutes=round(minutes, 1))
            for (cause, lane), minutes in sorted(
                slowed.items(), key=lambda one: -one[1]
            )
            if minutes >= _LEAST_MINUTES
        ],
        "tasks": [_task(one) for one in tasks],
    }


def _near(
    rows: CostRows, changes: cost.SpeedChanges, greenhouse: Greenhouse
) -> dict[str, Any]:
    misses = near_misses.near_misses(rows.near, changes, greenhouse)
    return {
        "near": [_miss(one) for one in misses[: cost.MOST_MISSES]],
        "near_count": len(misses),
        "heat": [
            Heat(x=x * near_misses.CELL_M, y=y * near_misses.CELL_M, seconds=seconds)
            for (x, y), seconds in sorted(near_misses.heat(rows.near).items())
        ],
    }


def _events(rows: CostRows) -> dict[str, Any]:
    return {
        "encounters": rows.met,
        "encounters_slowed": rows.met_slow,
        "alerts": [
            AlertCount(priority=priority, key=key, count=count)
            for (priority, key), count in rows.alerts.items()
        ],
        "stops": rows.stops,
        "drills": rows.drills,
    }


def _miss(one: near_misses.NearMiss) -> NearMiss:
    worst = one.worst
    return NearMiss(
        at=format_stamp(worst.at),
        robot_id=worst.robot_id,
        distance_m=round(worst.distance_m, 2),
        speed=round(worst.speed, 2),
        seconds=one.seconds,
        robot=Point(x=round(worst.x, 2), y=round(worst.y, 2)),
        lane=one.lane,
        decision_id=one.decision_id,
    )


def _task(one: cost.TaskCost) -> TaskCost:
    task = one.task
    lost_s = one.lost_s
    return TaskCost(
        robot_id=one.robot_id,
        command_id=None if task is None else task.task_id,
        state=None if task is None else task.state,
        since=None if task is None else format_stamp(task.since),
        until=None if task is None else format_stamp(task.until),
        slowed_minutes=round(one.slowed_s / 60.0, 1),
        held_minutes=round(one.held_s / 60.0, 1),
        free_speed=rounded(one.free_speed, 2),
        lost_m=rounded(one.lost_m, 1),
        lost_minutes=None if lost_s is None else round(lost_s / 60.0, 1),
    )


def router(read: ReadCost, pages: Pages, read_clock: Clock) -> APIRouter:
    """One range as numbers, two as a page."""
    routes = APIRouter()
    who = Depends(require("read"))

    @routes.get(
        "/api/v1/cost",
        response_model=Cost,
        dependencies=[who],
        tags=["history"],
        summary="What limits cost over a range, and how near it was",
        description="The last 24 hours unless told; 31 days at most.",
    )
    async def numbers(asked: Annotated[Span, Query()]) -> Response:
        return Json(await read(*range_of(asked, read_clock().wall, _DAY_S)))

    @routes.get("/compare", response_model=None, include_in_schema=False)
    async def compare(
        request: Request,
        visitor: Annotated[Any, who],
        asked: Annotated[_TwoSpans, Query()],
    ) -> Response:
        now = read_clock().wall
        today = in_madrid(now).date()
        one = _range_or_day(asked.since, asked.until, today, now)
        than = _range_or_day(asked.than_since, asked.than_until, today - _DAY, now)
        found = [await read(*span) for span in (than, one)]
        page = ComparePage(pages.frame(request, "compare", visitor), *found)
        return await asyncio.to_thread(pages.draw, page)

    return routes


def _range_or_day(
    since: datetime | None, until: datetime | None, day: date, now: float
) -> tuple[float, float]:
    """What was asked for, or a day as far as it has gone."""
    if since is None and until is None:
        return start_of(day), min(start_of(day + _DAY), now)
    # Their order is looked at there, for both spans in the same words.
    return range_of(Span.model_construct(since=since, until=until), now, _DAY_S)
