"""Lists of records, newest first, in pages that stay in step while rows are added.

A page ends in a cursor that names its last row, not a count of rows, so that neither
new rows nor deep pages make the next one wrong or slow.
"""

import base64
import binascii
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Generic, TypeVar

import orjson
from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    RowMapping,
    Table,
    literal,
    or_,
    select,
    tuple_,
)

from iveg.adapters.history import tables
from iveg.domain.errors import UnreadableError
from iveg.domain.records import (
    AlertRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
    Record,
)

USUAL_ROWS, MOST_ROWS = 100, 1000

R = TypeVar("R", bound=Record)


@dataclass(frozen=True, slots=True)
class Cursor:
    """The last row of a page: its time and what tells it from others of that time."""

    at: float
    key: int | str


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """Which rows of a list; None does not ask.  A row without the field is not asked.

    Attributes:
        since: Inclusive; ``until`` exclusive (Unix seconds).
        class_: Canonical class, or class as the detector said.
        person: Id of a person.
        min_probability: Inclusive, 0 to 1.
        limit: Rows of a page.
    """

    since: float | None = None
    until: float | None = None
    robot: str | None = None
    class_: str | None = None
    person: str | None = None
    min_probability: float | None = None
    limit: int = USUAL_ROWS
    cursor: Cursor | None = None


@dataclass(frozen=True, slots=True)
class Page(Generic[R]):
    """Some rows, newest first, and where the next page starts; None at the end."""

    items: tuple[R, ...]
    next: Cursor | None


@dataclass(frozen=True, slots=True)
class ListOf(Generic[R]):
    """Listing of one kind of record.

    Attributes:
        at: The column that orders it; ``key`` settles equal times.
        classes: Columns that the class filter looks at.
        which: Rows that are in the list at all; None: every one of the table.
    """

    kind: type[R]
    table: Table
    at: Column[float]
    key: Column[int] | Column[str]
    classes: tuple[Column[str], ...] = ()
    probability: Column[float] | None = None
    which: ColumnElement[bool] | None = None


DECISIONS = ListOf(
    DecisionRecord,
    tables.decisions,
    tables.decisions.c.started_at,
    tables.decisions.c.decision_id,
    (tables.decisions.c.class_, tables.decisions.c.class_id),
    tables.decisions.c.confidence,
)
DETECTIONS = ListOf(
    DetectionRecord,
    tables.detections,
    tables.detections.c.at,
    tables.detections.c.row_id,
    (tables.detections.c.class_, tables.detections.c.class_id),
    tables.detections.c.probability,
)
TRACKS = replace(DETECTIONS, which=tables.detections.c.person_id.is_not(None))
ODOMETRY = ListOf(
    OdometryRecord,
    tables.odometry,
    tables.odometry.c.at,
    tables.odometry.c.row_id,
)
COMMANDS = ListOf(
    CommandRecord,
    tables.commands,
    tables.commands.c.requested_at,
    tables.commands.c.command_id,
)
ALERTS = ListOf(
    AlertRecord,
    tables.alerts,
    tables.alerts.c.last_raised_at,
    tables.alerts.c.alert_id,
)
LOG = ListOf(
    LogRecord,
    tables.log,
    tables.log.c.at,
    tables.log.c.row_id,
    (tables.log.c.class_,),
)

READINGS = ListOf(
    ReadingRecord,
    tables.readings,
    tables.readings.c.at,
    tables.readings.c.row_id,
    (tables.readings.c.kind,),
)
MEASUREMENTS = ListOf(
    MeasurementRecord,
    tables.measurements,
    tables.measurements.c.at,
    tables.measurements.c.row_id,
    (tables.measurements.c.entity_id, tables.measurements.c.attribute),
)


def read_page(connection: Connection, of: ListOf[R], asked: Filter) -> Page[R]:
    """One page of a list."""
    limit = min(max(asked.limit, 1), MOST_ROWS)
    statement = (
        select(of.table)
        .where(*conditions(of, asked))
        .order_by(of.at.desc(), of.key.desc())
        .limit(limit + 1)
    )
    rows = connection.execute(statement).mappings().all()
    items = tuple(record_of(of.kind, row) for row in rows[:limit])
    if len(rows) <= limit:
        return Page(items, None)
    last = rows[limit - 1]
    return Page(items, Cursor(last[of.at], last[of.key]))


def conditions(of: ListOf[R], asked: Filter) -> Iterator[ColumnElement[bool]]:
    """SQL conditions of a filter."""
    if of.which is not None:
        yield of.which
    if asked.since is not None:
        yield of.at >= asked.since
    if asked.until is not None:
        yield of.at < asked.until
    if asked.robot is not None and "robot_id" in of.table.c:
        yield of.table.c.robot_id == asked.robot
    if asked.person is not None and "person_id" in of.table.c:
        yield of.table.c.person_id == asked.person
    if asked.class_ is not None and of.classes:
        yield or_(*(column == asked.class_ for column in of.classes))
    if asked.min_probability is not None and of.probability is not None:
        yield of.probability >= asked.min_probability
    if asked.cursor is not None:
        last = (literal(asked.cursor.at), literal(asked.cursor.key))
        yield tuple_(of.at, of.key) < tuple_(*last)


def record_of(kind: type[R], row: RowMapping) -> R:
    """A row as the record that was offered; what a damaged row lacks is its default."""
    columns = tables.TABLE_MAPPINGS[kind].table.c
    values = {field.name: row[columns[field.name]] for field in fields(kind)}
    return kind(**{name: one for name, one in values.items() if one is not None})


def write_cursor(cursor: Cursor) -> str:
    """A cursor as opaque text that fits into a URL."""
    text = base64.urlsafe_b64encode(orjson.dumps([cursor.at, cursor.key]))
    return text.decode().rstrip("=")


def read_cursor(text: str, of: ListOf[R]) -> Cursor:
    """A cursor that ``write_cursor`` wrote for the same list.

    Raises:
        UnreadableError: it did not.
    """
    try:
        padded = text.encode("ascii") + b"=" * (-len(text) % 4)
        at, key = orjson.loads(base64.urlsafe_b64decode(padded))
    except (ValueError, TypeError, binascii.Error) as error:
        raise UnreadableError("bad_cursor") from error
    if not isinstance(at, float) or not _is_key(key, of):
        raise UnreadableError("bad_cursor")
    return Cursor(at, key)


def _is_key(key: object, of: ListOf[R]) -> bool:
    # Only what a column can hold: the rest would fail inside the database.
    if of.key.type.python_type is int:
        return type(key) is int and 0 <= key < 2**63
    return isinstance(key, str) and key.isascii() and key.isprintable()
