"""Lists of records in pages that stay in step while rows are added.

A page ends in a cursor that names its last row, not a count of rows, so that neither
new rows nor deep pages make the next one wrong or slow.
"""

import base64
import binascii
import string
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from hashlib import blake2s
from typing import Any, Generic, TypeVar

import orjson
from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    RowMapping,
    Table,
    and_,
    func,
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
        sorts: Columns that it can be sorted by beside its time, by name.
    """

    kind: type[R]
    classes: tuple[str, ...] = ()
    which: ColumnElement[bool] | None = None
    sorts: Mapping[str, str] = field(default_factory=dict)

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
DECISIONS = ListOf(DecisionRecord, _SEEN, sorts={"robot": "robot_id"})
DETECTIONS = ListOf(DetectionRecord, _SEEN)
TRACKS = replace(DETECTIONS, which=tables.detections.c.person_id.is_not(None))
ODOMETRY = ListOf(OdometryRecord)
COMMANDS = ListOf(CommandRecord, sorts={"robot": "robot_id", "kind": "kind"})
ALERTS = ListOf(AlertRecord, sorts={"robot": "robot_id", "priority": "priority"})
LOG = ListOf(LogRecord, ("class_",), sorts={"robot": "robot_id", "kind": "kind"})
NOTE = "log.note"
NOTES = replace(LOG, which=tables.log.c.key == NOTE)
READINGS = ListOf(ReadingRecord, ("kind",))
MEASUREMENTS = ListOf(MeasurementRecord, ("entity_id", "attribute"))
AUDIT = ListOf(AuditRecord, ("action", "name"))


@dataclass(frozen=True, slots=True)
class Cursor:
    """The last row of a page: its time and what tells it from others of that time.

    Attributes:
        question: What was asked for (``lists.question_of``): only that goes on here.
        group: Its value in the column that the list is sorted by; None: by time.
    """

    at: float
    key: int | str
    question: str = ""
    group: str | None = None


def write_cursor(cursor: Cursor) -> str:
    """A cursor as opaque text that fits into a URL."""
    group = () if cursor.group is None else (cursor.group,)
    parts = [cursor.at, cursor.key, cursor.question, *group]
    text = base64.urlsafe_b64encode(orjson.dumps(parts))
    return text.decode().rstrip("=")


def read_cursor(text: str, of: ListOf[R]) -> Cursor:
    """A cursor that ``write_cursor`` wrote for the same list.

    Raises:
        UnreadableError: it did not.
    """
    try:
        padded = text.encode("ascii") + b"=" * (-len(text) % 4)
        at, key, question, *group = orjson.loads(base64.urlsafe_b64decode(padded))
    except (ValueError, TypeError, binascii.Error) as error:
        raise UnreadableError("bad_cursor") from error
    is_group = [*map(type, group)] in ([], [str]) and "".join(group).isprintable()
    is_named = isinstance(question, str) and is_group
    if not (isinstance(at, float) and _is_key(key, of) and is_named):
        raise UnreadableError("bad_cursor")
    return Cursor(at, key, question, *group)


def _is_key(key: object, of: ListOf[R]) -> bool:
    # Only what a column can hold: the rest would fail inside the database.
    if of.key.type.python_type is int:
        return type(key) is int and 0 <= key < 2**63
    return isinstance(key, str) and key.isascii() and key.isprintable()


USUAL_ROWS, MOST_ROWS = 100, 1000
BY_TIME, NEWEST_FIRST = "at", "-at"


@dataclass(frozen=True, slots=True, kw_only=True)
class Filter:
    """Which rows of a list; None does not ask.  A row without the field is not asked.

    Attributes:
        since: Inclusive; ``until`` exclusive (Unix seconds).
        class_: Canonical class, or class as the detector said.
        person: Id of a person.
        min_probability: Inclusive, 0 to 1.
        limit: Rows of a page.
        sort: ``at``, or one of the list's ``sorts``, a ``-`` before it for downwards;
            rows of one value are newest first.
    """

    since: float | None = None
    until: float | None = None
    robot: str | None = None
    class_: str | None = None
    person: str | None = None
    min_probability: float | None = None
    limit: int = USUAL_ROWS
    cursor: Cursor | None = None
    sort: str = NEWEST_FIRST


@dataclass(frozen=True, slots=True)
class Page(Generic[R]):
    """Some rows in their order, and where the next page starts; None at the end."""

    items: tuple[R, ...]
    next: Cursor | None


def read_page(connection: Connection, of: ListOf[R], asked: Filter) -> Page[R]:
    """One page of a list."""
    limit = min(max(asked.limit, 1), MOST_ROWS)
    group = _group(of, asked.sort)
    statement = (
        select(of.table)
        .where(*conditions(of, asked), *_after(of, group, asked))
        .order_by(*_order(of, group, asked.sort))
        .limit(limit + 1)
    )
    rows = connection.execute(statement).mappings().all()
    items = tuple(record_of(of.kind, row) for row in rows[:limit])
    if len(rows) <= limit:
        return Page(items, None)
    last = rows[limit - 1]
    value = None if not group else last[of.table.c[of.sorts[_name(asked.sort)]]] or ""
    asked_for = question_of(of, asked)
    return Page(items, Cursor(last[of.at], last[of.key], asked_for, value))


def question_of(of: ListOf[Any], asked: Filter) -> str:
    """Digest of a question: its list, filters and order."""
    rows = of.table.name, str(of.which), replace(asked, limit=0, cursor=None)
    return blake2s(repr(rows).encode(), digest_size=6).hexdigest()


def _name(sort: str) -> str:
    return sort.removeprefix("-")


def _group(of: ListOf[R], sort: str) -> tuple[ColumnElement[Any], ...]:
    """Columns that sort a list before its time; empty: by that alone."""
    if _name(sort) == BY_TIME:
        return ()
    return _as_counted(func.coalesce(of.table.c[of.sorts[_name(sort)]], ""))


def _as_counted(name: ColumnElement[str]) -> tuple[ColumnElement[Any], ...]:
    """Sort keys of names that may end in a number, as people count: R2 before R10.

    Of the names that differ by that number alone, the shorter has the smaller.
    """
    return func.rtrim(name, string.digits), func.length(name), name


def _order(
    of: ListOf[R], group: tuple[ColumnElement[Any], ...], sort: str
) -> Iterator[ColumnElement[Any]]:
    falls = sort.startswith("-")
    for column in group:
        yield column.desc() if falls else column.asc()
    falls = falls or bool(group)
    for column in (of.at, of.key):
        yield column.desc() if falls else column.asc()


def _after(
    of: ListOf[R], group: tuple[ColumnElement[Any], ...], asked: Filter
) -> Iterator[ColumnElement[bool]]:
    """Condition of the rows after the cursor."""
    if (cursor := asked.cursor) is None:
        return
    falls = asked.sort.startswith("-")
    place = tuple_(of.at, of.key)
    last = tuple_(literal(cursor.at), literal(cursor.key))
    if not group:
        yield place < last if falls else place > last
    else:
        here = tuple_(*group)
        there = tuple_(*_as_counted(literal(cursor.group)))
        beyond = here < there if falls else here > there
        yield or_(beyond, and_(here == there, place < last))


def conditions(of: ListOf[R], asked: Filter) -> Iterator[ColumnElement[bool]]:
    """SQL conditions of a filter."""
    if of.which is not None:
        yield of.which
    if asked.since is not None:
        yield of.at >= asked.since
    if asked.until is not None:
        yield of.at < asked.until
    columns = of.table.c
    robot = columns.get("robot_id", columns.get("subject"))
    if asked.robot is not None and robot is not None:
        yield robot == asked.robot
    person = columns.get("person_id", columns.get("person"))
    if asked.person is not None and person is not None:
        yield person == asked.person
    if asked.class_ is not None and of.classes:
        yield or_(*(columns[name] == asked.class_ for name in of.classes))
    probability = columns.get("probability", columns.get("confidence"))
    if asked.min_probability is not None and probability is not None:
        yield probability >= asked.min_probability


def record_of(kind: type[R], row: RowMapping) -> R:
    """A row as the record that was offered; what a damaged row lacks is its default."""
    table = TABLE_MAPPINGS[kind].table
    values = {one.key: row[table.c[one.key]] for one in COLUMNS[kind]}
    return kind(**{key: one for key, one in values.items() if one is not None})
