"""Series and counts for charts and the evening sheet, thinned in the database.

A range with few rows is answered row by row; a longer one in equal slices of time, each
with its mean speed and its strictest factor, so that a short slow-down is never lost.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import ColumnElement, Connection, Integer, cast, func, select

from iveg.adapters.history.lists import record_of
from iveg.adapters.history.tables import (
    climate,
    commands,
    detections,
    measurements,
    odometry,
)
from iveg.domain.day import DaySighting, Pose
from iveg.domain.fleet import as_counted
from iveg.domain.records import ByTransport, CommandRecord


def whole(connection: Connection, value: ColumnElement[Any]) -> ColumnElement[int]:
    """Rounded down: a cast does that on SQLite, and rounds to nearest on PostgreSQL."""
    if connection.dialect.name == "sqlite":
        return cast(value, Integer)
    return cast(func.floor(value), Integer)


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
        slice_s: Length of a slice (s); 0 where each point is one row.
    """

    robot_id: str
    at: tuple[float, ...]
    linear: tuple[float, ...]
    limit: tuple[float, ...]
    applied: tuple[float | None, ...]
    margin: tuple[float | None, ...]
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
        rows = (o.at, o.linear, o.limit_factor, o.applied_factor, o.margin_m)
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


CONFIDENCE_BINS = 20


@dataclass(frozen=True, slots=True)
class ConfidenceCount:
    """Number of detections of a class in one interval of confidence.

    Attributes:
        class_id: As the detector said.
        least: Lower edge, inclusive; the slice is 1 / ``CONFIDENCE_BINS`` wide.
    """

    class_id: str
    least: float
    count: int


def confidence_counts(
    connection: Connection, since: float, until: float, robot: str | None = None
) -> tuple[ConfidenceCount, ...]:
    """Detections of ``since <= at < until`` by class and confidence."""
    bins = detections.c.probability * CONFIDENCE_BINS
    place = whole(connection, bins).label("place")
    statement = (
        select(detections.c.class_id, place, func.count())
        .where(detections.c.at >= since, detections.c.at < until)
        .group_by(detections.c.class_id, place)
    )
    if robot is not None:
        statement = statement.where(detections.c.robot_id == robot)
    counts: dict[tuple[str, int], int] = {}
    for class_id, number, count in connection.execute(statement):
        # Certainty itself, 1.0, belongs to the uppermost slice.
        slot = (class_id, min(int(number), CONFIDENCE_BINS - 1))
        counts[slot] = counts.get(slot, 0) + count
    return tuple(
        ConfidenceCount(class_id, slot / CONFIDENCE_BINS, count)
        for (class_id, slot), count in sorted(counts.items())
    )


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
        select(second, func.avg(c.x), func.avg(c.y), c.robot_id)
        .where(c.at >= since, c.at < until, c.confident, c.class_ == "person")
        # A place that is no longer kept is no place near a robot.
        .where(c.x.is_not(None))
        # Two people of one second must not become one between them.
        .group_by(c.robot_id, c.person_id, second)
        .order_by(second)
    )
    return tuple(DaySighting(*row) for row in connection.execute(wanted))
