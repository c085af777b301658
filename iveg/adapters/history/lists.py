"""Lists of records in pages that stay in step while rows are added.

A page ends in a cursor that names its last row, not a count of rows, so that neither
new rows nor deep pages make the next one wrong or slow.
"""

import string
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from hashlib import blake2s
from typing import Any, Generic

from sqlalchemy import (
    ColumnElement,
    Connection,
    RowMapping,
    and_,
    func,
    literal,
    or_,
    select,
    tuple_,
)

from iveg.adapters.history.cursors import Cursor
from iveg.adapters.history.listings import ListOf, R
from iveg.adapters.history.table_mappings import TABLE_MAPPINGS

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
    value = None if not group else last[of.sorts[_name(asked.sort)]] or ""
    asked_for = question_of(of, asked)
    return Page(items, Cursor(last[of.at], last[of.key], asked_for, value))


def question_of(of: ListOf[Any], asked: Filter) -> str:
    """What tells a question from others: its list, filters and order, short."""
    rows = of.table.name, str(of.which), replace(asked, limit=0, cursor=None)
    return blake2s(repr(rows).encode(), digest_size=6).hexdigest()


def _name(sort: str) -> str:
    return sort.removeprefix("-")


def _group(of: ListOf[R], sort: str) -> tuple[ColumnElement[Any], ...]:
    """What a list is sorted by before its time; empty: by that alone."""
    if _name(sort) == BY_TIME:
        return ()
    return _as_counted(func.coalesce(of.sorts[_name(sort)], ""))


def _as_counted(name: ColumnElement[str]) -> tuple[ColumnElement[Any], ...]:
    """What sorts names that may end in a number as people count: R2 before R10.

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
    """What comes after the cursor."""
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
        yield or_(*(column == asked.class_ for column in of.classes))
    if asked.min_probability is not None and of.probability is not None:
        yield of.probability >= asked.min_probability


def record_of(kind: type[R], row: RowMapping) -> R:
    """A row as the record that was offered; what a damaged row lacks is its default."""
    columns = TABLE_MAPPINGS[kind].table.c
    values = {field.name: row[columns[field.name]] for field in fields(kind)}
    return kind(**{name: one for name, one in values.items() if one is not None})
