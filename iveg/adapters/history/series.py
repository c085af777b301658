"""Series for charts, thinned in the database to what a screen can show.

A range with few rows is answered row by row; a longer one in equal slices of time, each
with its mean speed and its strictest factor, so that a short slow-down is never lost.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import (
    ColumnElement,
    Connection,
    Integer,
    cast,
    func,
    select,
)

from iveg.adapters.history.rounding import whole
from iveg.adapters.history.tables import (
    climate,
    measurements,
    odometry,
)
from iveg.domain.fleet import as_counted

MOST_POINTS = 2000
MOST_READINGS = 288
"""A day of the air in slices of five minutes."""
READING_PERIOD_S = 60.0
"""Between two kept readings (``pipeline.event_log``)."""


@dataclass(frozen=True, slots=True)
class SpeedSeries:
    """Speed, speed limits and margin of one robot over a range.

    Attributes:
        at: Unix seconds, rising; the others have its length.
        linear: (m/s), mean of a slice.
        limited to: Strictest factor that iVeg limited to in a slice.
        applied: Strictest factor that the robot reported; None where it was silent.
        margin: Least margin (m); None where it was unknown or there was none.
        late: Whether the robot sent some of it after a gap: nobody acted on it.
        slice_s: Length of a slice (s); 0 where each point is one row.
    """

    robot_id: str
    at: tuple[float, ...]
    linear: tuple[float, ...]
    limit: tuple[float, ...]
    applied: tuple[float | None, ...]
    margin: tuple[float | None, ...]
    late: tuple[bool, ...]
    slice_s: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True, slots=True)
class ClimateSeries:
    """The air over a range; None where a sensor was silent.

    Attributes:
        at: Unix seconds, rising; the others have its length.
        temperature: (°C), mean of a slice; ``relative_humidity`` 0 to 1, ``co2`` (ppm).
        slice_s: Length of a slice (s); 0 where each point is one reading.
    """

    at: tuple[float, ...] = ()
    temperature: tuple[float | None, ...] = ()
    relative_humidity: tuple[float | None, ...] = ()
    co2: tuple[float | None, ...] = ()
    slice_s: float = field(default=0.0, kw_only=True)


@dataclass(frozen=True, slots=True)
class MeasurementSeries:
    """One attribute of other equipment over a range.

    Attributes:
        at: Unix seconds, rising; ``value`` has its length, a slice its mean.
        slice_s: Length of a slice (s); 0 where each point is one reading.
    """

    at: tuple[float, ...]
    value: tuple[float, ...]
    slice_s: float = field(default=0.0, kw_only=True)


def speed_series(
    connection: Connection,
    since: float,
    until: float,
    robot: str | None = None,
) -> tuple[SpeedSeries, ...]:
    """One series for each robot with data in ``since <= at < until``: R2 before R10."""
    robots = [robot] if robot else sorted(_robots(connection), key=as_counted)
    found = (_one(connection, one, since, until) for one in robots)
    return tuple(series for series in found if series.at)


def climate_series(connection: Connection, since: float, until: float) -> ClimateSeries:
    """The air in ``since <= at < until``."""
    c = climate.c
    asked = (c.at >= since, c.at < until)
    values = (c.temperature, c.relative_humidity, c.co2)
    count = connection.scalar(select(func.count()).where(*asked)) or 0
    if count <= MOST_READINGS:
        return ClimateSeries(*_columns(connection, (c.at, *values), asked))
    slice_s = (until - since) / MOST_READINGS
    place = whole(connection, (c.at - since) / slice_s)
    means = (func.min(c.at), *(func.avg(value) for value in values))
    return ClimateSeries(*_columns(connection, means, asked, place), slice_s=slice_s)


def measurement_series(
    connection: Connection, since: float, until: float
) -> dict[tuple[str, str], MeasurementSeries]:
    """Every attribute in ``since <= at < until``, by entity and attribute.

    A range with more than a reading in each slice is answered in slices.
    """
    c = measurements.c
    slice_s = (until - since) / MOST_READINGS
    is_sliced = slice_s > READING_PERIOD_S
    place = whole(connection, (c.at - since) / slice_s) if is_sliced else c.row_id
    names = (c.entity_id, c.attribute)
    wanted = (
        select(*names, func.min(c.at), func.avg(c.value))
        .where(c.at >= since, c.at < until)
        .group_by(*names, place)
        .order_by(*names, func.min(c.at))
    )
    found: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for entity_id, attribute, at, value in connection.execute(wanted):
        found.setdefault((entity_id, attribute), []).append((at, value))
    width_s = slice_s if is_sliced else 0.0
    return {
        key: MeasurementSeries(*zip(*points, strict=True), slice_s=width_s)
        for key, points in found.items()
    }


def _robots(connection: Connection) -> Iterator[str]:
    """All robots in the table, by a hop along the index for each, not by a scan."""
    last = ""
    while True:
        statement = select(func.min(odometry.c.robot_id))
        found = connection.scalar(statement.where(odometry.c.robot_id > last))
        if found is None:
            return
        last = found
        yield last


def _one(connection: Connection, robot: str, since: float, until: float) -> SpeedSeries:
    o = odometry.c
    asked = (o.robot_id == robot, o.at >= since, o.at < until)
    # Three looks at the index; to count all rows takes as long as to read them.
    enough = select(o.at).where(*asked).limit(MOST_POINTS + 1).subquery()
    first, last, count = connection.execute(
        select(
            select(func.min(o.at)).where(*asked).scalar_subquery(),
            select(func.max(o.at)).where(*asked).scalar_subquery(),
            select(func.count()).select_from(enough).scalar_subquery(),
        )
    ).one()
    if count <= MOST_POINTS:
        rows = (o.at, o.linear, o.limit_factor, o.applied_factor, o.margin_m, o.late)
        return SpeedSeries(robot, *_columns(connection, rows, asked))
    # One slice fewer than asked for: the last row may stand on the last edge.
    slice_s = (last - first) / (MOST_POINTS - 1) or 1.0
    place = whole(connection, (o.at - first) / slice_s)
    slices = (
        func.min(o.at),
        func.avg(o.linear),
        func.min(o.limit_factor),
        func.min(o.applied_factor),
        func.min(o.margin_m),
        func.max(cast(o.late, Integer)),
    )
    return SpeedSeries(
        robot, *_columns(connection, slices, asked, place), slice_s=slice_s
    )


def _columns(
    connection: Connection,
    wanted: Sequence[ColumnElement[Any]],
    asked: Iterable[ColumnElement[bool]],
    *place: ColumnElement[int],
) -> list[tuple[Any, ...]]:
    """The values of each column in order of the first; grouped by ``place``."""
    statement = select(*wanted).where(*asked).group_by(*place).order_by(wanted[0])
    rows = connection.execute(statement).all()
    return list(zip(*rows, strict=True)) or [()] * len(wanted)
