"""Batches of records into the tables: one transaction each, all or nothing.

A batch that fails because of one bad row is stored row by row; the bad one is counted
and left out, so that it cannot hold up everything behind it.
"""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields
from functools import cache
from typing import TypeVar

from sqlalchemy import Connection, Engine, Insert, Table, delete
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.exc import (
    DataError,
    DBAPIError,
    IntegrityError,
    InterfaceError,
    ProgrammingError,
    StatementError,
)

from iveg.adapters import clock
from iveg.adapters.history.audit import write_audit
from iveg.adapters.history.engine import writing_engine
from iveg.adapters.history.migrate import reason_of, upgrade
from iveg.adapters.history.table_mappings import TABLE_MAPPINGS, TableMapping
from iveg.domain.errors import HopError
from iveg.domain.records import AuditRecord, CommandEventRecord, CommandRecord, Record
from iveg.pipeline.record import Waiting

_log = logging.getLogger(__name__)
_Row = dict[str, object]
_T = TypeVar("_T")
_FIELDS = {kind: tuple(f.name for f in fields(kind)) for kind in TABLE_MAPPINGS}
_DURABLE = CommandRecord | CommandEventRecord | AuditRecord
_VALUE_ERRORS = (ValueError, TypeError, OverflowError)


class Store:
    """The one writer's side of the database; blocks, so it lives in a thread."""

    def __init__(self, database_url: str) -> None:
        self._url = database_url
        self._engine: Engine | None = None
        self.rejected = 0
        """Rows that the database can never take."""

    def write(self, rows: Sequence[Waiting]) -> None:
        """Store a batch; on failure nothing of it is stored.

        Raises:
            HopError: the database is away, locked, full or damaged.
            DataFileError: it cannot be brought to the shape that is written here.
        """
        engine = self._ready()
        try:
            _write(engine, rows)
        except (StatementError, *_VALUE_ERRORS) as error:
            if not _is_fault_of_row(error, engine):
                self._let_go(error)
                raise HopError("database", reason_of(error)) from error
            self._write_one_by_one(engine, rows)

    def run(self, work: Callable[[Connection], _T]) -> _T:
        """Other work of the one writer, in a transaction of its own.

        Raises:
            HopError: the database is away, locked, full or damaged.
            DataFileError: it cannot be brought to the shape that is written here.
        """
        engine = self._ready()
        try:
            with engine.connect() as connection:
                _choose_durability(connection, ())
                with connection.begin():
                    return work(connection)
        except DBAPIError as error:
            self._let_go(error)
            raise HopError("database", reason_of(error)) from error

    def close(self) -> None:
        """Let go of the connection; the next write makes a new one."""
        if self._engine is not None:
            self._engine.dispose()
            self._engine = None

    def _ready(self) -> Engine:
        # Looking again after every loss heals a file that was damaged or replaced.
        if self._engine is None:
            upgrade(self._url)
            self._engine = writing_engine(self._url)
        return self._engine

    def _let_go(self, error: Exception) -> None:
        # These pass by themselves; checking the whole file again would only add to it.
        if not any(word in str(error) for word in ("is locked", "is full")):
            self.close()

    def _write_one_by_one(self, engine: Engine, rows: Sequence[Waiting]) -> None:
        with engine.connect() as connection:
            _choose_durability(connection, rows)
            try:
                with connection.begin():
                    for row in rows:
                        self._try_one(connection, row)
            except DBAPIError as error:
                self._let_go(error)
                raise HopError("database", reason_of(error)) from error

    def _try_one(self, connection: Connection, row: Waiting) -> None:
        try:
            with connection.begin_nested():
                _insert(connection, [row])
        except (StatementError, *_VALUE_ERRORS) as error:
            if not _is_fault_of_row(error, connection.engine):
                raise
            self.rejected += 1
            kind = type(row.record).__name__
            _log.error("history: a %s cannot be stored: %s", kind, reason_of(error))


def _write(engine: Engine, rows: Sequence[Waiting]) -> None:
    with engine.connect() as connection:
        _choose_durability(connection, rows)
        with connection.begin():
            _insert(connection, rows)


def _choose_durability(connection: Connection, rows: Sequence[Waiting]) -> None:
    """SQLite waits for the disk where the batch holds commands or their audit trail.

    Past the pool's back, because SQLAlchemy would begin a transaction for it, and
    inside one SQLite ignores the change.
    """
    if connection.dialect.name != "sqlite":
        return
    level = "FULL" if any(isinstance(r.record, _DURABLE) for r in rows) else "NORMAL"
    connection.connection.cursor().execute(f"PRAGMA synchronous={level}")


def _insert(connection: Connection, rows: Sequence[Waiting]) -> None:
    for kind, mapping in TABLE_MAPPINGS.items():
        of_kind = [row for row in rows if type(row.record) is kind]
        if kind is AuditRecord:
            write_audit(connection, [row.record for row in of_kind], clock.wall())
            continue
        values = _values(of_kind, mapping)
        if values:
            connection.execute(_statement(kind, connection.dialect.name), values)
            if mapping.keep_s is not None:
                _forget(connection, mapping.table, values, mapping.keep_s)


def _forget(
    connection: Connection, table: Table, values: list[_Row], keep_s: float
) -> None:
    """Delete rows that are older than all of these by more than their time.

    One row from the future (a clock that was wrong for a moment) deletes nothing: not
    beside others of its batch, nor by itself, where this machine's clock knows better.
    """
    oldest = min(float(str(one["at"])) for one in values)
    before = min(oldest, clock.wall()) - keep_s
    connection.execute(delete(table).where(table.c.at < before))


def _values(rows: Iterable[Waiting], mapping: TableMapping) -> list[_Row]:
    """Rows as columns; of several states of one thing only the newest."""
    if not mapping.changes:
        return [_columns(row.record) for row in rows]
    newest: dict[tuple[object, ...], _Row] = {}
    for row in sorted(rows, key=lambda row: row.revision):
        values = _columns(row.record) | {"revision": row.revision}
        newest[tuple(values[name] for name in mapping.identity)] = values
    return list(newest.values())


def _columns(record: Record) -> _Row:
    return {name: getattr(record, name) for name in _FIELDS[type(record)]}


@cache
def _statement(kind: type[Record], dialect: str) -> Insert:
    mapping = TABLE_MAPPINGS[kind]
    make = postgresql.insert if dialect == "postgresql" else sqlite.insert
    statement = make(mapping.table)
    if not mapping.identity:
        return statement
    names = [mapping.table.c[key] for key in mapping.identity]
    if not mapping.changes:
        return statement.on_conflict_do_nothing(index_elements=names)
    return statement.on_conflict_do_update(
        index_elements=names,
        set_={c: statement.excluded[c.key] for c in mapping.table.c if c not in names},
        where=mapping.table.c.revision <= statement.excluded.revision,
    )


def _is_fault_of_row(error: Exception, engine: Engine) -> bool:
    """Whether the values are the cause; else it is the database, and all can wait."""
    if not isinstance(error, DBAPIError):
        return True
    if isinstance(error, IntegrityError | DataError):
        return True
    refused = (InterfaceError, ProgrammingError)
    # Python's SQLite driver reports a type that it cannot bind in one of these two.
    return engine.dialect.name == "sqlite" and isinstance(error, refused)
