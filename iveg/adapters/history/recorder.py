"""Recorder: moves records into the database, and never makes the pipeline wait.

One task gathers batches, one thread writes each in a transaction.  Rows of orders go to
the journal at once (``flushed``), which holds them until the database has them.  While
the database is away, all others wait in a bounded queue whose oldest rows give way::

    enqueue ──> queue ──> batch ──> database
       └─ orders ─> journal ─┘  at the next start

Rows whose values the database refuses are counted and left out, with all rows of their
kind in the batch, so that they cannot hold up everything behind them.
"""

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Literal, TypeVar

from sqlalchemy import Connection, Engine, Insert
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
from iveg.adapters.history.engine import reason_of, sqlite_file, upgrade, writing_engine
from iveg.adapters.history.tables import TABLE_MAPPINGS, TableMapping
from iveg.adapters.journal import FileJournal
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant
from iveg.domain.records import (
    COLUMNS,
    Record,
    is_order,
)
from iveg.vital.record import CAPACITY, RecordQueue, Waiting

_log = logging.getLogger(__name__)
_Row = dict[str, object]
_T = TypeVar("_T")
_VALUE_ERRORS = (ValueError, TypeError, OverflowError)


class Store:
    """Write access to the database; blocks, so it is used in a thread."""

    def __init__(self, database_url: str) -> None:
        self._url = database_url
        self._engine: Engine | None = None
        self.rejected = 0
        """Rows that the database has refused for their values."""

    def write(self, rows: Sequence[Waiting]) -> None:
        """Store a batch; on failure nothing of it is stored.

        Raises:
            HopError: the database is away, locked, full or damaged.
            DataFileError: it cannot be migrated to the newest schema.
        """
        self.run(lambda connection: self._insert(connection, rows))

    def run(self, work: Callable[[Connection], _T]) -> _T:
        """Do work in a transaction of its own.

        Raises:
            HopError: the database is away, locked, full or damaged.
            DataFileError: it cannot be migrated to the newest schema.
        """
        engine = self._ready()
        try:
            with engine.begin() as connection:
                return work(connection)
        except DBAPIError as error:
            # A lock or a full disk passes; the whole file need not be checked again.
            if not any(word in str(error) for word in ("is locked", "is full")):
                self.close()
            raise HopError("database", reason_of(error)) from error

    def _insert(self, connection: Connection, rows: Sequence[Waiting]) -> None:
        for kind, mapping in TABLE_MAPPINGS.items():
            same = [row for row in rows if type(row.record) is kind]
            if not same:
                continue
            try:
                with connection.begin_nested():
                    statement = _statement(mapping, connection.dialect.name)
                    connection.execute(statement, _values(same, mapping))
            except (StatementError, *_VALUE_ERRORS) as error:
                if not _is_fault_of_row(error, connection.engine):
                    raise
                self.rejected += len(same)
                name, reason = kind.__name__, reason_of(error)
                _log.error("history: %d %s not stored: %s", len(same), name, reason)

    def close(self) -> None:
        """Close the connection; the next write opens another."""
        if self._engine is not None:
            self._engine.dispose()
            self._engine = None

    def _ready(self) -> Engine:
        # A check after every loss repairs a file that was damaged or replaced.
        if self._engine is None:
            upgrade(self._url)
            self._engine = writing_engine(self._url)
        return self._engine


def _values(rows: Iterable[Waiting], mapping: TableMapping) -> list[_Row]:
    """Rows as columns; of several states of a thing the newest alone."""
    if not mapping.changes:
        return [_columns(row.record) for row in rows]
    newest: dict[tuple[object, ...], _Row] = {}
    for row in sorted(rows, key=lambda row: row.revision):
        values = _columns(row.record) | {"revision": row.revision}
        newest[tuple(values[name] for name in mapping.identity)] = values
    return list(newest.values())


def _columns(record: Record) -> _Row:
    return {column.key: column.read(record) for column in COLUMNS[type(record)]}


@cache
def _statement(mapping: TableMapping, dialect: str) -> Insert:
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
    """Whether values are the cause; if the database is, rows can wait."""
    if isinstance(error, IntegrityError | DataError) or not isinstance(
        error, DBAPIError
    ):
        return True
    refusals = (InterfaceError, ProgrammingError)
    # Python's SQLite driver reports a type that it cannot bind by one of these two.
    return engine.dialect.name == "sqlite" and isinstance(error, refusals)


_BATCH = 500
_GATHER_S = 0.25
"""Time in which a batch gathers, so that its commit is worth the cost (s)."""
_RETRY_S = 2.0
_LATE_S = 2.0
"""Longest wait of a row while the history counts as healthy (s)."""


class Recorder:
    """The history's writing side; ``enqueue`` from the event loop's thread only.

    Args:
        database_url: Database, which is migrated before the first write.
        journal: Holds rows of orders.
        read_clock: Clock for the age of waiting records and the order of revisions.

    Attributes:
        caught_up: Set once the database has all rows of earlier runs' journal.
    """

    def __init__(
        self,
        database_url: str,
        journal: FileJournal,
        *,
        capacity: int = CAPACITY,
        read_clock: Callable[[], Instant] = clock.now,
    ) -> None:
        self.flushed = journal.flushed
        self._store = Store(database_url)
        self._journal = journal
        self._clock = read_clock
        self._queue = RecordQueue(capacity)
        self._thread = ThreadPoolExecutor(1, "history")
        self._awake, self.caught_up = asyncio.Event(), asyncio.Event()
        self._writing: asyncio.Task[bool] | None = None
        self._written = self._revision = 0
        self._lost_since: float | None = None

    # --- what the pipeline calls --------------------------------------------------

    def enqueue(self, record: Record) -> None:
        """Queue a record; never blocks, never awaits, never fails."""
        now = self._clock()
        # The wall clock orders states across restarts, the count within a run.
        self._revision = max(self._revision + 1, int(now.wall * 1e9))
        waiting = Waiting(record, self._revision, now.mono)
        if is_order(record):
            self._journal.note(waiting)
        self._queue.enqueue(waiting)
        self._awake.set()

    def state(self) -> Literal["ok", "late", "down"]:
        """State of the database: whether rows reach it, within 2 s or later."""
        if self._lost_since is not None:
            return "down"
        oldest, now = self._queue.oldest_since(), self._clock().mono
        return "late" if oldest is not None and now - oldest > _LATE_S else "ok"

    @property
    def counters(self) -> Mapping[str, int]:
        """Rows by outcome since the start, and rows that wait now."""
        return {
            "history_written": self._written,
            "history_dropped": self._queue.dropped,
            "history_rejected": self._store.rejected,
            "history_waiting": len(self._queue),
        }

    # --- other writes -------------------------------------------------------------

    async def between_batches(self, work: Callable[[Connection], _T]) -> _T:
        """Do other work in a transaction between two batches.

        Raises:
            HopError: the database is away.
            DataFileError: it cannot be used.
        """
        return await asyncio.wrap_future(self._thread.submit(self._store.run, work))

    # --- the one writer -----------------------------------------------------------

    async def run(self) -> None:
        """Write until cancelled; call ``close`` afterwards."""
        now = self._clock().mono
        self._queue.put_back([replace(row, since=now) for row in self._journal.left()])
        while True:
            self._awake.clear()
            self._writing = asyncio.create_task(
                self._write(self._queue.dequeue(_BATCH)), name="history-batch"
            )
            # Shielded: `close` waits for a batch that the thread still writes.
            if not await asyncio.shield(self._writing):
                await asyncio.sleep(_RETRY_S)
            elif not len(self._queue):
                await self._awake.wait()
                await asyncio.sleep(_GATHER_S)

    async def close(self) -> None:
        """Store waiting rows, and close the database; orders stay in the journal."""
        if self._writing is not None:
            await asyncio.wait({self._writing})
        while len(self._queue) and self._lost_since is None:
            await self._write(self._queue.dequeue(_BATCH))
        await self.flushed()
        waiting = self._queue.dequeue(len(self._queue))
        if lost_rows := sum(not is_order(row.record) for row in waiting):
            self._queue.dropped += lost_rows
            _log.warning("history: %d rows were not stored", lost_rows)
        await asyncio.wrap_future(self._thread.submit(self._store.close))
        self._thread.shutdown(wait=False)

    async def _write(self, batch: list[Waiting]) -> bool:
        """Store a batch, or put it back into the queue; whether it is stored."""
        try:
            await asyncio.wrap_future(self._thread.submit(self._store.write, batch))
        except Exception as error:
            # An error of the history must not end the process that a STOP needs.
            if not isinstance(error, HopError | DataFileError):
                _log.exception("history: an error of the program")
            if self._lost_since is None:
                self._lost_since = self._clock().mono
                _log.warning("history: database lost: %s", error)
            self._queue.put_back(batch)
            return False
        if self._lost_since is not None:
            away_s = self._clock().mono - self._lost_since
            _log.info("history: database is back after %.1f s", away_s)
            self._lost_since = None
        self._written += len(batch)
        if orders := {row.revision for row in batch if is_order(row.record)}:
            await self._journal.committed(orders)
        if not self._journal.left():
            self.caught_up.set()
        return True


def spilled_file(database_url: str, directory: Path) -> Path:
    """File of rows that an earlier version kept while its database was away.

    Raises:
        SettingsError: the address cannot be used.
    """
    file = sqlite_file(database_url)
    if file is None:
        return directory / "history.spill_file"
    return file.with_name(file.name + ".journal")
