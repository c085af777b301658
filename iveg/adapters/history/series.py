"""Series and counts for charts and the evening sheet, thinned in the database.

A short range is read row by row, a longer one in equal slices of time.  A slice has
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
from iveg.vital.event_log import READING_PERIOD_S
from iveg.vital.record import ODOMETRY_PERIOD_S


def whole(connection: Connection, value: ColumnElement[Any]) -> ColumnElement[int]:
    """Round down: a cast does so on SQLite, and rounds to nearest on PostgreSQL."""
    if connection.dialect.name == "sqlite":
        return cast(value, Integer)
    return cast(func.floor(value), Integer)


@dataclass(frozen=True, slots=True)
class Charted:
    """Columns of a table that are drawn over time.

    Attributes:
        keys: Columns that tell lines apart.
        values: Drawn column → function that reduces a slice to a value.
        most: Slices of a range at most.
        period_s: Time between two rows of a line (s): shorter slices reduce nothing.
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
# 288 slices: five minutes each over a day.
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
        at: Times of the points (Unix s), rising.
        values: Drawn column → a value for each point; None where it was silent.
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
    """Lines with data in ``since <= at < until`` (Unix s), by their keys."""
    c = charted.table.c
    slice_s = (until - since) / charted.most
    if slice_s <= charted.period_s:
        slice_s = 0.0
    group = whole(connection, (c.at - since) / slice_s) if slice_s else c.row_id
    keys = [c[name] for name in charted.keys]
    values = [reduced(c[name]) for name, reduced in charted.values.items()]
    statement = (
        select(*keys, func.min(c.at), *values)
        .where(c.at >= since, c.at < until)
        .group_by(*keys, group)
        .order_by(func.min(c.at))
    )
    if robot is not None:
        statement = statement.where(c.robot_id == robot)
    lines: dict[tuple[str, ...], list[tuple[Any, ...]]] = defaultdict(list)
    for row in connection.execute(statement):
        lines[tuple(row[: len(keys)])].append(tuple(row[len(keys) :]))
    series = {}
    for key, rows in lines.items():
        at, *columns = zip(*rows, strict=True)
        series[key] = Series(
            at, dict(zip(charted.values, columns, strict=True)), slice_s
        )
    return series


def poses_of(connection: Connection, since: float, until: float) -> tuple[Pose, ...]:
    """Mean pose of each robot in each second of ``since <= at < until``, in order."""
    c = odometry.c
    second = whole(connection, c.at)
    statement = (
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
    return tuple(Pose(*row) for row in connection.execute(statement))


def people_seen(
    connection: Connection, since: float, until: float
) -> tuple[DaySighting, ...]:
    """Mean position of each confirmed person in each second of that range."""
    c = detections.c
    second = whole(connection, c.at)
    statement = (
        select(second, func.avg(c.x), func.avg(c.y))
        .where(c.at >= since, c.at < until, c.confident, c.class_ == "person")
        # A position that was deleted by retention is near no robot.
        .where(c.x.is_not(None))
        # The mean of two people would be a place where nobody was.
        .group_by(c.robot_id, c.person_id, second)
        .order_by(second)
    )
    return tuple(DaySighting(*row) for row in connection.execute(statement))
