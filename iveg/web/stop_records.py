"""How long STOP took, and the drills that prove it (docs/interfaces.md §5).

Both are read from the history, so they outlive a restart and can be printed.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Path, Query
from starlette.responses import Response
from typing_extensions import TypedDict

from iveg.adapters.history.queries import Queries
from iveg.adapters.history.series import CommandLatency
from iveg.domain.observations import Instant
from iveg.domain.records import CommandRecord
from iveg.domain.stop.latency import Spread, spread
from iveg.ngsi.codec import format_stamp
from iveg.web import schemas
from iveg.web.auth import require
from iveg.web.history_filters import Range, range_of
from iveg.web.history_views import view_command
from iveg.web.robots import Json
from iveg.web.shapes import rounded

DRILL_DEADLINE_MS = 5000.0
"""Press to STANDING, safety.md §2.4."""
_DRILLS_SHOWN = 100


class SpreadJson(TypedDict):
    """Times of one step (ms); null where nothing was measured."""

    count: int
    p50_ms: float | None
    p95_ms: float | None
    max_ms: float | None


class RobotLatencyJson(TypedDict):
    """One robot's STOPs: how many, and each step from the press on."""

    robot_id: str
    stops: int
    accepted: SpreadJson
    sent_direct: SpreadJson
    sent_fiware: SpreadJson
    answer_direct: SpreadJson
    answer_fiware: SpreadJson
    standing: SpreadJson


class LatencyJson(TypedDict):
    """How long the newest STOPs of a range took."""

    since: str
    until: str
    robots: list[RobotLatencyJson]


class DrillJson(TypedDict):
    """One drill and its verdict."""

    robot_id: str
    command_id: str
    drilled_at: str
    by: str
    passed: bool | None
    standstill_ms: float | None
    command: dict[str, object]


class DrillList(TypedDict):
    """The newest drills first."""

    items: list[DrillJson]
    next: str | None


def router(
    queries: Queries,
    clock: Callable[[], Instant],
    find: Callable[[str, Instant], schemas.CommandJson | None],
) -> APIRouter:
    """What is remembered of STOP; ``find`` knows the commands of this run."""
    routes = APIRouter(
        prefix="/api/v1", tags=["commands"], dependencies=[Depends(require("read"))]
    )

    @routes.get("/commands/latency", response_model=LatencyJson)
    async def latency(asked: Annotated[Range, Query()]) -> Response:
        """P50, P95 and longest of each step, per robot; 15 minutes unless told."""
        since, until = range_of(asked, clock().wall)
        found = await queries.command_latencies(since, until, asked.robot)
        body: LatencyJson = {
            "since": format_stamp(since),
            "until": format_stamp(until),
            "robots": _by_robot(found),
        }
        return Json(body)

    @routes.get("/commands/{command_id}")
    async def command(
        command_id: Annotated[str, Path(pattern=r"^[ -~]{1,64}$")],
    ) -> Response:
        """One command: as it stands, or as the history knows it."""
        followed = find(command_id, clock())
        if followed is not None:
            return Json(followed)
        found = await queries.command(command_id)
        if found is None:
            raise HTTPException(404, "There is no such command.")
        steps = await queries.command_events(command_id)
        return Json(view_command(found, steps).model_dump(by_alias=True))

    @routes.get("/drills", response_model=DrillList)
    async def drills(robot: str | None = None) -> Response:
        """The newest drills, each with its verdict: standing within five seconds."""
        found = await queries.drills(robot, _DRILLS_SHOWN)
        now = clock().wall
        body: DrillList = {"items": [_drill(one, now) for one in found], "next": None}
        return Json(body)

    return routes


def _by_robot(found: Iterable[CommandLatency]) -> list[RobotLatencyJson]:
    by_robot: dict[str, list[CommandLatency]] = defaultdict(list)
    for one in found:
        by_robot[one.robot_id].append(one)
    return [_robot(robot_id, stops) for robot_id, stops in sorted(by_robot.items())]


def _robot(robot_id: str, stops: list[CommandLatency]) -> RobotLatencyJson:
    return {
        "robot_id": robot_id,
        "stops": len(stops),
        "accepted": _spread(spread(one.accepted_ms for one in stops)),
        "sent_direct": _spread(spread(one.sent_direct_ms for one in stops)),
        "sent_fiware": _spread(spread(one.sent_fiware_ms for one in stops)),
        "answer_direct": _spread(spread(one.direct_ms for one in stops)),
        "answer_fiware": _spread(spread(one.fiware_ms for one in stops)),
        "standing": _spread(spread(one.standstill_ms for one in stops)),
    }


def _spread(of: Spread) -> SpreadJson:
    return {
        "count": of.count,
        "p50_ms": rounded(of.p50, 1),
        "p95_ms": rounded(of.p95, 1),
        "max_ms": rounded(of.longest, 1),
    }


def _drill(record: CommandRecord, now: float) -> DrillJson:
    return {
        "robot_id": record.robot_id,
        "command_id": record.command_id,
        "drilled_at": format_stamp(record.requested_at),
        "by": record.requested_by,
        "passed": _passed(record, now),
        "standstill_ms": rounded(record.standstill_ms, 1),
        "command": view_command(record).model_dump(by_alias=True),
    }


def _passed(record: CommandRecord, now: float) -> bool | None:
    """None while it may still come true."""
    if record.standstill_ms is not None:
        return record.standstill_ms <= DRILL_DEADLINE_MS
    late = 1000.0 * (now - record.requested_at) > DRILL_DEADLINE_MS
    return False if late else None
