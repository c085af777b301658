"""What a range cost and how near it was, gathered in the database.

Two partial indexes of the odometry (``slowed_poses``, ``near_poses``) hold all that is
read here of a range but the free speed, so that a day of ten robots is read in the time
of its slow part.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import median
from typing import Any

from sqlalchemy import Connection, and_, case, func, literal, select, text

from iveg.adapters.history.partial_indexes import IS_NEAR, IS_SLOWED
from iveg.adapters.history.rounding import whole
from iveg.adapters.history.tables import (
    alerts,
    command_events,
    commands,
    decisions,
    detections,
    log,
    odometry,
)
from iveg.domain.cost import MOST_TASKS, SLOT_S, SlowSlot, SpeedChange, Task
from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.goals import OPEN_STATES
from iveg.domain.limits import LIMITS
from iveg.domain.near_misses import NEAR_M, NearSecond
from iveg.pipeline.record import ODOMETRY_PERIOD_S

_BEFORE_S = 3600.0
"""A slow-down that was told so long before the range may still hold in it (s)."""
_FREE_ROWS, _LEAST_FREE_ROWS = 2000, 20


@dataclass(frozen=True, slots=True)
class CostRows:
    """What the history knows of a range.

    Attributes:
        free_speed: Of each robot that drove freely (m/s).
        alerts: (priority, key) → how many.
        met: Encounters with people; ``met_slow`` those in which the robot slowed.
        stops: Without drills; ``drills`` these.
        places_since: The oldest place of anybody (Unix s); ``telemetry_since`` of a
            robot, ``events_since`` of the log; None where there is none.
    """

    slots: Sequence[SlowSlot]
    near: Sequence[NearSecond]
    changes: Sequence[SpeedChange]
    tasks: Sequence[Task]
    free_speed: Mapping[str, float]
    alerts: Mapping[tuple[str, str], int]
    met: int
    met_slow: int
    stops: int
    drills: int
    places_since: float | None
    telemetry_since: float | None
    events_since: float | None


def cost_rows(
    connection: Connection, since: float, until: float, braking: Mapping[str, float]
) -> CostRows:
    """Rows of ``since <= at < until``.

    ``braking``: what margins of each robot count on (m/s²).
    """
    slots = _slots(connection, since, until)
    met, met_slow = _met(connection, since, until)
    stops = _stops(connection, since, until)
    tasks = _tasks(connection, since, until)
    robots = {one.robot_id for one in slots} | {one.robot_id for one in tasks}
    return CostRows(
        slots=slots,
        near=_near(connection, since, until, braking),
        changes=_changes(connection, since - _BEFORE_S, until),
        tasks=tasks,
        free_speed=_free_speeds(connection, since, until, robots),
        alerts=_alerts(connection, since, until),
        met=met,
        met_slow=met_slow,
        stops=stops.get(False, 0),
        drills=stops.get(True, 0),
        places_since=connection.scalar(
            select(func.min(detections.c.at)).where(detections.c.x.is_not(None))
        ),
        telemetry_since=connection.scalar(select(func.min(odometry.c.at))),
        events_since=connection.scalar(select(func.min(log.c.at))),
    )


def _slots(connection: Connection, since: float, until: float) -> list[SlowSlot]:
    c = odometry.c
    slot = whole(connection, c.at / SLOT_S)
    is_half = case((c.applied_factor <= HALF_SPEED, 1.0), else_=0.0)
    means = (func.avg(one) for one in (is_half, c.x, c.y, func.abs(c.linear)))
    wanted = (
        select(slot, c.robot_id, func.count(), *means)
        .where(c.at >= since, c.at < until, text(IS_SLOWED))
        # In the order of the index, which sorts faster.
        .group_by(slot, c.robot_id)
    )
    return [_slot(*row) for row in connection.execute(wanted)]


def _slot(
    slot: int, robot_id: str, rows: int, half: float, x: float, y: float, speed: float
) -> SlowSlot:
    # Rows are half a second apart; changes of a factor are rows of their own.
    seconds = min(rows * ODOMETRY_PERIOD_S, SLOT_S)
    return SlowSlot(robot_id, slot * SLOT_S, seconds, seconds * half, x, y, speed)


def _near(
    connection: Connection, since: float, until: float, braking: Mapping[str, float]
) -> list[NearSecond]:
    c = odometry.c
    # What the margin leaves with the shortest reaction: no gap was less, so that few
    # seconds are left of which places must be read.
    second, speed = whole(connection, c.at), func.abs(c.linear)
    least = literal(LIMITS.least_braking_m_s2)
    # SQL has no case without a branch.
    brakes = case(dict(braking), value=c.robot_id, else_=least) if braking else least
    gap = c.margin_m + (
        LIMITS.walking_m_s * (LIMITS.reaction_s + speed / brakes)
        + speed * LIMITS.reaction_s
        + speed * speed / (2 * brakes)
        + LIMITS.uncertainty_m
    )
    poses = (
        select(
            c.robot_id,
            second.label("second"),
            func.avg(c.x).label("x"),
            func.avg(c.y).label("y"),
            func.max(speed).label("speed"),
        )
        .where(c.at >= since, c.at < until, text(IS_NEAR), gap <= NEAR_M)
        .where(speed >= LIMITS.standing_speed)
        .group_by(second, c.robot_id)
        .subquery()
    )
    p, d = poses.c, detections.c
    ahead, left = d.x - p.x, d.y - p.y
    squared = func.min(ahead * ahead + left * left)
    together = and_(d.at >= p.second, d.at < p.second + 1)
    somebody = and_(d.confident, d.class_ == "person", d.x.is_not(None))
    wanted = (
        select(p.robot_id, p.second, p.x, p.y, p.speed, squared)
        .select_from(poses.join(detections, together))
        .where(somebody)
        .group_by(p.robot_id, p.second, p.x, p.y, p.speed)
        .having(squared <= NEAR_M * NEAR_M)
    )
    return [
        NearSecond(robot_id, at, x, y, speed, sqrt(far))
        for robot_id, at, x, y, speed, far in connection.execute(wanted)
    ]


def _changes(connection: Connection, since: float, until: float) -> list[SpeedChange]:
    c = log.c
    wanted = select(c.robot_id, c.at, c.slots, c.decision_id).where(
        c.at >= since, c.at < until, c.kind == "speed"
    )
    return [
        SpeedChange(robot, at, float(slots["factor"]), str(slots["reason"]), decision)
        for robot, at, slots, decision in connection.execute(wanted)
        if robot is not None and slots and "factor" in slots and "reason" in slots
    ]


def _tasks(connection: Connection, since: float, until: float) -> list[Task]:
    """The newest goals that were given in the range."""
    c, step = commands.c, command_events.c
    last = (
        select(func.max(step.at))
        .where(step.command_id == c.command_id)
        .scalar_subquery()
    )
    wanted = (
        select(c.command_id, c.robot_id, c.state, c.requested_at, last)
        .where(c.kind == "goal", c.requested_at >= since, c.requested_at < until)
        .order_by(c.requested_at.desc(), c.command_id.desc())
        .limit(MOST_TASKS)
    )
    return [
        Task(task_id, robot_id, state, at, _end(state, ended, at, until))
        for task_id, robot_id, state, at, ended in connection.execute(wanted)
    ]


def _end(state: str, ended: float | None, at: float, until: float) -> float:
    is_open = state in OPEN_STATES or ended is None
    return max(at, until if is_open or ended is None else min(ended, until))


def _free_speeds(
    connection: Connection, since: float, until: float, robots: set[str]
) -> dict[str, float]:
    """The median of each robot's newest free rows."""
    c = odometry.c
    found: dict[str, float] = {}
    for robot in sorted(robots):
        wanted = (
            select(func.abs(c.linear))
            .where(c.robot_id == robot, c.at >= since, c.at < until)
            .where(c.applied_factor >= FULL_SPEED)
            .where(func.abs(c.linear) >= LIMITS.standing_speed)
            .order_by(c.at.desc())
            .limit(_FREE_ROWS)
        )
        speeds = connection.scalars(wanted).all()
        if len(speeds) >= _LEAST_FREE_ROWS:
            found[robot] = median(speeds)
    return found


def _alerts(
    connection: Connection, since: float, until: float
) -> dict[tuple[str, str], int]:
    c = alerts.c
    wanted = (
        select(c.priority, c.key, func.count())
        .where(c.last_raised_at >= since, c.last_raised_at < until)
        .group_by(c.priority, c.key)
        .order_by(c.priority, func.count().desc(), c.key)
    )
    return {(row[0], row[1]): row[2] for row in connection.execute(wanted)}


def _met(connection: Connection, since: float, until: float) -> tuple[int, int]:
    c = decisions.c
    wanted = select(func.count(), func.count(c.applied_at)).where(
        c.started_at >= since,
        c.started_at < until,
        c.kind == "mandate",
        c.reason == "person",
    )
    row: Any = connection.execute(wanted).one()
    return row[0], row[1]


def _stops(connection: Connection, since: float, until: float) -> dict[bool, int]:
    """How many are drills, and how many are not."""
    c = commands.c
    wanted = (
        select(c.drill, func.count())
        .where(c.kind == "stop", c.requested_at >= since, c.requested_at < until)
        .group_by(c.drill)
    )
    return {bool(row[0]): row[1] for row in connection.execute(wanted)}
