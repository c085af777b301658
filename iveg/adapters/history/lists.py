"""Lists of records, newest first, in pages that stay in step while rows are added.

A page ends in a cursor that names its last row, not a count of rows, so that neither
new rows nor deep pages make the next page wrong or slow.
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
    """List of one kind of record.

    Attributes:
        classes: Columns of the class filter.
        which: Condition of the rows in the list; None: every row of the table.
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
        """The column that orders rows of the same time."""
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
    """Last row of a page: its time (Unix s) and its key among rows of that time."""

    at: float
    key: int | str


def write_cursor(cursor: Cursor) -> str:
    """A cursor as opaque text that fits into a URL."""
    text = base64.urlsafe_b64encode(orjson.dumps([cursor.at, cursor.key]))
    return text.decode().rstrip("=")


def read_cursor(text: str, listed: ListOf[R]) -> Cursor:
    """Read a cursor of ``write_cursor`` for a list with such keys.

    Raises:
        UnreadableError: the text is no such cursor.
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
    # Only values that a column can hold: others would fail inside the database.
    if listed.key.type.python_type is int:
        return type(key) is int and 0 <= key < 2**63
    return isinstance(key, str) and key.isascii() and key.isprintable()


USUAL_ROWS, MOST_ROWS = 100, 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """Conditions on the rows of a list; None: any.

    A condition on a field that the rows lack holds for every row.

    Attributes:
        since: Start, inclusive; ``until`` is exclusive (Unix s).
        class_: Canonical class, or the detector's class.
        person: Id of a person.
        min_probability: Least probability, 0 to 1, inclusive.
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
    """Rows of a page, newest first, and the cursor of the next; None at the end."""

    items: tuple[R, ...]
    next: Cursor | None


def read_page(connection: Connection, listed: ListOf[R], wanted: Filter) -> Page[R]:
    """One page of a list."""
    limit = min(max(wanted.limit, 1), MOST_ROWS)
    # One row more tells whether another page follows.
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
    # Tables have either name of these columns.
    named = {
        "robot_id": wanted.robot,
        "subject": wanted.robot,
        "person_id": wanted.person,
        "person": wanted.person,
    }
    for name, value in named.items():
        if value is not None and name in columns:
            yield columns[name] == value
    if wanted.class_ is not None and listed.classes:
        yield or_(*(columns[name] == wanted.class_ for name in listed.classes))
    probability = columns.get("probability", columns.get("confidence"))
    if wanted.min_probability is not None and probability is not None:
        yield probability >= wanted.min_probability
    if wanted.cursor is not None:
        last = tuple_(literal(wanted.cursor.at), literal(wanted.cursor.key))
        yield tuple_(listed.at, listed.key) < last


def record_of(kind: type[R], row: RowMapping) -> R:
    """The record of a row; a member that a damaged row lacks has its default."""
    table = TABLE_MAPPINGS[kind].table
    values = {column.key: row[table.c[column.key]] for column in COLUMNS[kind]}
    return kind(**{key: value for key, value in values.items() if value is not None})
