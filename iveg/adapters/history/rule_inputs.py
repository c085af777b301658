"""What the history keeps of the rule's inputs, and what the rule decided."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, and_, false, or_, select

from iveg.adapters.history.tables import decisions, detections, odometry
from iveg.domain.what_if.inputs import Poses, SeenRow, poses_of
from iveg.domain.what_if.outcome import Decided


@dataclass(frozen=True, slots=True)
class RuleInputs:
    """Of a range and some robots, in order of time."""

    poses: Mapping[str, Poses]
    seen: Sequence[SeenRow]
    decided: Sequence[Decided]


def rule_inputs(
    connection: Connection, robots: Collection[str], since: float, until: float
) -> RuleInputs:
    """Everything of a range that judgements rest on (Unix s)."""
    poses = {name: _poses(connection, name, since, until) for name in sorted(robots)}
    there = {name: one for name, one in poses.items() if len(one.at)}
    seen = _seen(connection, robots, since, until)
    return RuleInputs(there, seen, _decided(connection, robots, since, until))


def _poses(connection: Connection, robot: str, since: float, until: float) -> Poses:
    c = odometry.c
    wanted = (
        select(c.at, c.x, c.y, c.yaw, c.linear, c.angular)
        .where(c.robot_id == robot, c.at >= since, c.at < until, c.late == false())
        .order_by(c.at)
    )
    # A day has a million: rows of the library would double the time.
    sql = str(wanted.compile(connection, compile_kwargs={"literal_binds": True}))
    cursor = connection.connection.cursor()
    cursor.execute(sql)
    return poses_of(cursor.fetchall())


def _seen(
    connection: Connection, robots: Collection[str], since: float, until: float
) -> Sequence[SeenRow]:
    c = detections.c
    # A robot without a track is one of the fleet, whose own odometry counts.
    somebody = or_(
        c.class_ == "person", and_(c.class_ == "robot", c.person_id.is_not(None))
    )
    wanted = (
        select(c.robot_id, c.at, c.x, c.y, c.probability, c.class_, c.person_id)
        .where(c.at >= since, c.at < until, c.late == false(), c.x.is_not(None))
        .where(somebody, c.robot_id.in_(sorted(robots)))
        .order_by(c.at)
    )
    return [tuple(row) for row in connection.execute(wanted)]


def _decided(
    connection: Connection, robots: Collection[str], since: float, until: float
) -> Sequence[Decided]:
    c = decisions.c
    wanted = select(c.robot_id, c.reason, c.started_at, c.ended_at).where(
        c.kind == "mandate",
        c.robot_id.in_(sorted(robots)),
        c.started_at < until,
        or_(c.ended_at.is_(None), c.ended_at >= since),
        # An index finds those: no slow-down lasts for so long.
        c.started_at >= since - 86_400.0,
    )
    return [tuple(row) for row in connection.execute(wanted)]
