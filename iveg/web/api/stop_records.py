"""Latency of STOP, and its drills (docs/interfaces/http.md).

Both are read from the history, so they outlive a restart and can be printed.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable
from typing import Annotated

from fastapi import APIRouter, Depends, HTTPException, Path, Query, Response

from iveg.adapters.history.command_latencies import CommandLatency, command_latencies
from iveg.adapters.history.listings import COMMANDS
from iveg.adapters.history.queries import Queries
from iveg.domain.errors import HopError
from iveg.domain.fleet import as_counted
from iveg.domain.observations import Instant
from iveg.domain.records import ByTransport, CommandRecord
from iveg.domain.stamps import format_stamp
from iveg.domain.transports import TRANSPORTS, TransportId
from iveg.models.base import Listing, rounded
from iveg.models.command import Command
from iveg.models.stop_latency import Drill, Latency, LatencySpread, RobotLatency
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.history_filters import Range, range_of
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

DRILL_DEADLINE_MS = 5000.0
"""Press to STANDING, docs/safety.md, "Times of a STOP"."""
_DRILLS_SHOWN = 100


def router(
    queries: Queries,
    clock: Clock,
    find: Callable[[str, Instant], Command | None],
) -> APIRouter:
    """Routes of past STOPs; ``find`` knows the commands of this run."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["commands"],
        dependencies=[Depends(require("read"))],
        responses=refusals(503),
    )

    @routes.get("/commands/latency", response_model=Latency)
    async def latency(asked: Annotated[Range, Query()]) -> Response:
        """P50, P95 and longest of each step, per robot; 15 minutes unless told."""
        since, until = range_of(asked, clock().wall)
        found = await queries.ask(command_latencies, since, until, asked.robot)
        body = Latency(
            since=format_stamp(since),
            until=format_stamp(until),
            robots=_by_robot(found),
        )
        return Json(body)

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

    @routes.get("/drills", response_model=Listing[Drill])
    async def drills(robot: str | None = None) -> Response:
        """The newest drills, each with its verdict: standing within five seconds."""
        found = await queries.drills(robot, _DRILLS_SHOWN)
        now = clock().wall
        return Json(Listing(items=[_drill(one, now) for one in found]))

    return routes


async def _kept(queries: Queries, command_id: str) -> Command | None:
    found = await queries.one(COMMANDS, command_id)
    if found is None:
        return None
    return Command.of_record(found, await queries.command_events(command_id))


def _joined(followed: Command | None, kept: Command | None) -> Command | None:
    """What goes on, beside what only the history tells: how it ended, and its steps."""
    if followed is None or kept is None:
        return followed or kept
    ended = {"outcome": kept.outcome, "was_loud": kept.was_loud, "steps": kept.steps}
    return followed.model_copy(update=ended)


def _by_robot(found: Iterable[CommandLatency]) -> list[RobotLatency]:
    by_robot: dict[str, list[CommandLatency]] = defaultdict(list)
    for one in found:
        by_robot[one.robot_id].append(one)
    robots = sorted(by_robot, key=as_counted)
    return [_robot(robot_id, by_robot[robot_id]) for robot_id in robots]


def _robot(robot_id: str, stops: list[CommandLatency]) -> RobotLatency:
    return RobotLatency(
        robot_id=robot_id,
        stops=len(stops),
        accepted=LatencySpread.of(one.accepted_ms for one in stops),
        sent=_by_transport([one.sent_ms for one in stops]),
        answer=_by_transport([one.answer_ms for one in stops]),
        standing=LatencySpread.of(one.standstill_ms for one in stops),
    )


def _by_transport(took: list[ByTransport]) -> dict[TransportId, LatencySpread]:
    """Of each transport of the table, and of those that rows know besides."""
    known = dict.fromkeys(one.id for one in TRANSPORTS)
    known |= dict.fromkeys(transport for one in took for transport in one)
    return {
        transport: LatencySpread.of(one.get(transport) for one in took)
        for transport in known
    }


def _drill(record: CommandRecord, now: float) -> Drill:
    return Drill(
        robot_id=record.robot_id,
        command_id=record.command_id,
        drilled_at=format_stamp(record.requested_at),
        by=record.requested_by,
        passed=_passed(record, now),
        standstill_ms=rounded(record.standstill_ms, 1),
        command=Command.of_record(record),
    )


def _passed(record: CommandRecord, now: float) -> bool | None:
    """None while it may still come true."""
    if record.standstill_ms is not None:
        return record.standstill_ms <= DRILL_DEADLINE_MS
    late = 1000.0 * (now - record.requested_at) > DRILL_DEADLINE_MS
    return False if late else None
