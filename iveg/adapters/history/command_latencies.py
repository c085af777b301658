"""Times of the newest STOPs of a range."""

from dataclasses import dataclass

from sqlalchemy import Connection, select

from iveg.adapters.history.lists import record_of
from iveg.adapters.history.series import MOST_POINTS
from iveg.adapters.history.tables import commands
from iveg.domain.records import ByTransport, CommandRecord


@dataclass(frozen=True, slots=True)
class CommandLatency:
    """Times of one STOP from the press (ms); None where a step never came.

    Without a told press, the press is when it was accepted.

    Attributes:
        answer_ms: To the robot's answer by each transport that brought one.
        standstill_ms: To the first standing sample.
        accepted_ms: To this server, where the page told when it was pressed.
        sent_ms: Until it left by each transport that took it.
    """

    command_id: str
    robot_id: str
    requested_at: float
    answer_ms: ByTransport
    sent_ms: ByTransport
    standstill_ms: float | None
    accepted_ms: float | None = None


def command_latencies(
    connection: Connection, since: float, until: float, robot: str | None = None
) -> tuple[CommandLatency, ...]:
    """The newest STOPs of ``since <= requested_at < until``, oldest first."""
    c = commands.c
    statement = (
        select(commands)
        .where(c.kind == "stop", c.requested_at >= since, c.requested_at < until)
        .order_by(c.requested_at.desc(), c.command_id.desc())
        .limit(MOST_POINTS)
    )
    if robot is not None:
        statement = statement.where(c.robot_id == robot)
    rows = connection.execute(statement).mappings().all()
    return tuple(_latency(record_of(CommandRecord, row)) for row in reversed(rows))


def _latency(record: CommandRecord) -> CommandLatency:
    pressed = record.pressed_at
    asked = record.requested_at if pressed is None else pressed
    return CommandLatency(
        record.command_id,
        record.robot_id,
        record.requested_at,
        {one: _ms(asked, at) for one, at in record.answer_at.items()},
        {one: _ms(asked, at) for one, at in record.sent_at.items()},
        record.standstill_ms,
        None if pressed is None else _ms(pressed, record.requested_at),
    )


def _ms(start: float, end: float) -> float:
    return 1000.0 * (end - start)
