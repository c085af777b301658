"""Series and counts for charts and the evening sheet, thinned in the database.

A short range is answered row by row; a longer one in equal slices of time, each with
its mean speed and its strictest factor, so that a short slow-down is never lost.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import ColumnElement, Connection, Integer, Table, cast, func, select

from iveg.adapters.history.tables import (
    climate,
    detections,
    measurements,
    odometry,
)
from iveg.domain.day import DaySighting, Pose
from iveg.vital.record import ODOMETRY_PERIOD_S


def whole(connection: Connection, value: ColumnElement[Any]) -> ColumnElement[int]:
    """Rounded down: a cast does that on SQLite, and rounds to nearest on PostgreSQL."""
    if connection.dialect.name == "sqlite":
        return cast(value, Integer)
    return cast(func.floor(value), Integer)


READING_PERIOD_S = 60.0
"""Between two kept readings (``vital.event_log``)."""


@dataclass(frozen=True, slots=True)
class Charted:
    """Columns of a table that are drawn over time.

    Attributes:
        keys: Columns that tell one line from another.
        values: Drawn column → function that makes one value of a slice.
        most: Slices of a range.
        period_s: Between two rows of a line; a shorter slice would hold one at most.
    """

    table: Table
    keys: tuple[str, ...]
    values: Mapping[str, Callable[[ColumnElement[Any]], ColumnElement[Any]]]
    most: int
    period_s: float


SPEEDS = Charted(
    odometry,
    ("robot_id",),
    {"linear": func.avg, "limit_factor": func.min},
    2000,
    ODOMETRY_PERIOD_S,
)
AIR = Charted(
    climate,
    (),
    dict.fromkeys(("temperature", "relative_humidity", "co2"), func.avg),
    288,
    READING_PERIOD_S,
)
EQUIPMENT = Charted(
    measurements,
    ("entity_id", "attribute"),
    {"value": func.avg},
    288,
    READING_PERIOD_S,
)


@dataclass(frozen=True, slots=True)
class Series:
    """One line over a range.

    Attributes:
        at: Unix seconds, rising.
        values: Drawn column → its values, as many; None where it was silent.
        slice_s: Length of a slice (s); 0 where each point is one row.
    """

    at: tuple[float, ...]
    values: Mapping[str, tuple[float | None, ...]]
    slice_s: float = 0.0


def series_of(
    connection: Connection,
    charted: Charted,
    since: float,
    until: float,
    robot: str | None = None,
) -> dict[tuple[str, ...], Series]:
    """The lines with data in ``since <= at < until``, by their keys."""
    c = charted.table.c
    slice_s = (until - since) / charted.most
    if slice_s <= charted.period_s:
        slice_s = 0.0
    place = whole(connection, (c.at - since) / slice_s) if slice_s else c.row_id
    keys = [c[name] for name in charted.keys]
    values = [reduced(c[name]) for name, reduced in charted.values.items()]
    statement = (
        select(*keys, func.min(c.at), *values)
        .where(c.at >= since, c.at < until)
        .group_by(*keys, place)
        .order_by(func.min(c.at))
    )
    if robot is not None:
        statement = statement.where(c.robot_id == robot)
    lines: dict[tuple[str, ...], list[tuple[Any, ...]]] = defaultdict(list)
    for row in connection.execute(statement):
        lines[tuple(row[: len(keys)])].append(tuple(row[len(keys) :]))
    found = {}
    for key, rows in lines.items():
        at, *columns = zip(*rows, strict=True)
        found[key] = Series(
            at, dict(zip(charted.values, columns, strict=True)), slice_s
        )
    return found


def poses_of(connection: Connection, since: float, until: float) -> tuple[Pose, ...]:
    """Poses of robots in each second of ``since <= at < until``, in order."""
    c = odometry.c
    second = whole(connection, c.at)
    wanted = (
        select(
            c.robot_id,
            second,
            func.avg(c.x),
            func.avg(c.y),
            func.avg(func.abs(c.linear)),
        )
        .where(c.at >= since, c.at < until)
        .group_by(c.robot_id, second)
        .order_by(second)
    )
    return tuple(Pose(*row) for row in connection.execute(wanted))


def people_seen(
    connection: Connection, since: float, until: float
) -> tuple[DaySighting, ...]:
    """Positions of confirmed people in each second of ``since <= at < until``."""
    c = detections.c
    second = whole(connection, c.at)
    wanted = (
        select(second, func.avg(c.x), func.avg(c.y))
        .where(c.at >= since, c.at < until, c.confident, c.class_ == "person")
        # A place that is no longer kept is no place near a robot.
        .where(c.x.is_not(None))
        # Two people of one second must not become one between them.
        .group_by(c.robot_id, c.person_id, second)
        .order_by(second)
    )
    return tuple(DaySighting(*row) for row in connection.execute(wanted))
