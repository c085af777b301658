"""Lists of records, newest first, in pages that stay in step while rows are added.

A page ends in a cursor that names its last row, not a count of rows, so that neither
new rows nor deep pages make the next one wrong or slow.
"""

import base64
import binascii
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

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
from iveg.adapters.history.tables import TABLE_MAPPINGS
from iveg.domain.errors import UnreadableError
from iveg.domain.records import (
    COLUMNS,
    AlertRecord,
    AuditRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
    Record,
)

R = TypeVar("R", bound=Record)


@dataclass(frozen=True, slots=True)
class ListOf(Generic[R]):
    """Listing of one kind of record.

    Attributes:
        classes: Columns that the class filter looks at.
        which: Rows that are in the list at all; None: every one of the table.
    """

    kind: type[R]
    classes: tuple[str, ...] = ()
    which: ColumnElement[bool] | None = None

    @property
    def table(self) -> Table:
        """The table of its records."""
        return TABLE_MAPPINGS[self.kind].table

    @property
    def at(self) -> Column[Any]:
        """The column that orders it."""
        return TABLE_MAPPINGS[self.kind].at

    @property
    def key(self) -> Column[Any]:
        """The column that settles equal times."""
        return TABLE_MAPPINGS[self.kind].key


_SEEN = "class_", "class_id"
DECISIONS = ListOf(DecisionRecord, _SEEN)
DETECTIONS = ListOf(DetectionRecord, _SEEN)
TRACKS = replace(DETECTIONS, which=tables.detections.c.person_id.is_not(None))
ODOMETRY = ListOf(OdometryRecord)
COMMANDS = ListOf(CommandRecord)
STOPS = replace(COMMANDS, which=tables.commands.c.kind == "stop")
ALERTS = ListOf(AlertRecord)
LOG = ListOf(LogRecord, ("class_",))
NOTE = "log.note"
NOTES = replace(LOG, which=tables.log.c.key == NOTE)
READINGS = ListOf(ReadingRecord, ("kind",))
MEASUREMENTS = ListOf(MeasurementRecord, ("entity_id", "attribute"))
AUDIT = ListOf(AuditRecord, ("action", "name"))


@dataclass(frozen=True, slots=True)
class Cursor:
    """Last row of a page: its time, and what tells it from others of that time."""

    at: float
    key: int | str


def write_cursor(cursor: Cursor) -> str:
    """A cursor as opaque text that fits into a URL."""
    text = base64.urlsafe_b64encode(orjson.dumps([cursor.at, cursor.key]))
    return text.decode().rstrip("=")


def read_cursor(text: str, listed: ListOf[R]) -> Cursor:
    """A cursor that ``write_cursor`` wrote for a list with such keys.

    Raises:
        UnreadableError: it did not.
    """
    try:
        padded = text.encode("ascii") + b"=" * (-len(text) % 4)
        at, key = orjson.loads(base64.urlsafe_b64decode(padded))
    except (ValueError, TypeError, binascii.Error) as error:
        raise UnreadableError("bad_cursor") from error
    if not (isinstance(at, float) and _is_key(key, listed)):
        raise UnreadableError("bad_cursor")
    return Cursor(at, key)


def _is_key(key: object, listed: ListOf[R]) -> bool:
    # Only what a column can hold: the rest would fail inside the database.
    if listed.key.type.python_type is int:
        return type(key) is int and 0 <= key < 2**63
    return isinstance(key, str) and key.isascii() and key.isprintable()


USUAL_ROWS, MOST_ROWS = 100, 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """Conditions on the rows of a list; None: any.

    One on a field that the rows lack holds for each of them.

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


def read_page(connection: Connection, listed: ListOf[R], wanted: Filter) -> Page[R]:
    """One page of a list."""
    limit = min(max(wanted.limit, 1), MOST_ROWS)
    statement = (
        select(listed.table)
        .where(*conditions(listed, wanted))
        .order_by(listed.at.desc(), listed.key.desc())
        .limit(limit + 1)
    )
    rows = connection.execute(statement).mappings().all()
    items = tuple(record_of(listed.kind, row) for row in rows[:limit])
    if len(rows) <= limit:
        return Page(items, None)
    last = rows[limit - 1]
    return Page(items, Cursor(last[listed.at], last[listed.key]))


def conditions(listed: ListOf[R], wanted: Filter) -> Iterator[ColumnElement[bool]]:
    """SQL conditions of a filter and its cursor."""
    if listed.which is not None:
        yield listed.which
    if wanted.since is not None:
        yield listed.at >= wanted.since
    if wanted.until is not None:
        yield listed.at < wanted.until
    columns = listed.table.c
    robot = columns.get("robot_id", columns.get("subject"))
    if wanted.robot is not None and robot is not None:
        yield robot == wanted.robot
    person = columns.get("person_id", columns.get("person"))
    if wanted.person is not None and person is not None:
        yield person == wanted.person
    if wanted.class_ is not None and listed.classes:
        yield or_(*(columns[name] == wanted.class_ for name in listed.classes))
    probability = columns.get("probability", columns.get("confidence"))
    if wanted.min_probability is not None and probability is not None:
        yield probability >= wanted.min_probability
    if wanted.cursor is not None:
        last = tuple_(literal(wanted.cursor.at), literal(wanted.cursor.key))
        yield tuple_(listed.at, listed.key) < last


def record_of(kind: type[R], row: RowMapping) -> R:
    """A row as the record that was offered; what a damaged row lacks is its default."""
    table = TABLE_MAPPINGS[kind].table
    values = {one.key: row[table.c[one.key]] for one in COLUMNS[kind]}
    return kind(**{key: one for key, one in values.items() if one is not None})
