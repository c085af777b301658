"""Moves offered records into the database, without ever making the pipeline wait.

One task gathers batches, one thread writes them.  While the database is away, records
that may not be lost go to the journal and telemetry waits its turn in the queue::

    enqueue ──> queue ──> batch ──> database
                └─ away ─> journal ─┘  on its return, and at the next start

Commands do not wait for a batch:  ``flushed`` puts them into the journal at once, and a
row that is then written twice is stored once.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

from sqlalchemy import Connection

from iveg.adapters import clock
from iveg.adapters.history.engine import sqlite_file
from iveg.adapters.history.spill_file import SpillFile
from iveg.adapters.history.store import Store
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant
from iveg.domain.records import CommandEventRecord, CommandRecord, Record
from iveg.pipeline.record import CAPACITY, RecordQueue, Waiting

_log = logging.getLogger(__name__)
_T = TypeVar("_T")
_BATCH = 500
_GATHER_S = 0.25
_LATE_S = 2.0
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.5, 5.0


@dataclass(frozen=True, slots=True)
class RecorderHealth:
    """Health of the recorder.

    Attributes:
        state: ``ok``, ``late`` (something waits longer than 2 s) or ``down``.
        age_s: How long the oldest record has waited to be stored (s).
        detail: Why the database is away; empty when it is not.
        counters: written, dropped, journalled, replayed, rejected, waiting.
    """

    state: Literal["ok", "late", "down"]
    age_s: float
    detail: str
    counters: Mapping[str, int]


class Recorder:
    """The history's writing side; ``enqueue`` from the event loop's thread only.

    Args:
        database_url: Brought to the newest shape before the first write.
        journal: File of the journal, beside the database.
        read_clock: For the age of waiting records and the order of revisions.
    """

    def __init__(
        self,
        database_url: str,
        journal: Path,
        *,
        capacity: int = CAPACITY,
        read_clock: Callable[[], Instant] = clock.now,
    ) -> None:
        self._store = Store(database_url)
        self._journal = SpillFile(journal)
        self._clock = read_clock
        self._queue = RecordQueue(capacity)
        self._thread = ThreadPoolExecutor(1, "history")
        # A STOP waits for its audit row: no thread of anything else may delay that.
        self._journal_thread = ThreadPoolExecutor(1, "history-journal")
        self._unflushed: list[Waiting] = []
        self._securing = asyncio.Lock()
        self._awake, self._full = asyncio.Event(), asyncio.Event()
        self._caught_up = asyncio.Event()
        self._writing: asyncio.Task[None] | None = None
        self._closing = False
        self._revision = 0
        self._written = self._journalled = self._replayed = self._lost_at_close = 0
        self._lost_since: float | None = None
        self._detail = ""
        self._pause_s = _FIRST_PAUSE_S
        # What an earlier run could not store goes first.
        self._awake.set()

    # --- what the pipeline calls --------------------------------------------------

    def enqueue(self, record: Record) -> None:
        """Queue a record; never blocks, never awaits, never fails."""
        waiting = self._stamp(record)
        if isinstance(record, CommandRecord | CommandEventRecord):
            self._unflushed.append(waiting)
        self._queue.enqueue(waiting)
        self._awake.set()
        if len(self._queue) >= _BATCH:
            self._full.set()

    async def flushed(self) -> None:
        """Return when every command and audit row so far is in the journal.

        For a STOP, which must survive a crash of the next millisecond.  Those who ask
        at the same time share one write; a disk that refuses leaves the rows in memory
        like any other, and is seen in ``health``.
        """
        async with self._securing:
            rows, self._unflushed = self._unflushed, []
            if rows:
                await self._append(rows)

    async def caught_up(self) -> None:
        """Return when the database has what earlier runs left in the journal."""
        await self._caught_up.wait()

    def health(self, now: Instant) -> RecorderHealth:
        """The recorder's health at this moment."""
        oldest = self._queue.oldest_since()
        age = 0.0 if oldest is None else max(0.0, now.mono - oldest)
        if self._lost_since is not None:
            age = max(age, now.mono - self._lost_since)
            return RecorderHealth("down", age, self._detail, self.counters)
        state: Literal["ok", "late"] = "late" if age > _LATE_S else "ok"
        return RecorderHealth(state, age, "", self.counters)

    @property
    def counters(self) -> Mapping[str, int]:
        """Rows since the start, and rows that wait now."""
        return {
            "history_written": self._written,
            "history_dropped": self._queue.dropped + self._lost_at_close,
            "history_journalled": self._journalled,
            "history_replayed": self._replayed,
            "history_rejected": self._store.rejected + self._journal.unreadable,
            "history_waiting": len(self._queue),
        }

    # --- beside it ----------------------------------------------------------------

    @property
    def is_busy(self) -> bool:
        """Whether rows wait that go before any other work.

        Not while the database is away: a full disk has no room for them before
        something is deleted.
        """
        return self._lost_since is None and len(self._queue) >= _BATCH

    async def between_batches(self, work: Callable[[Connection], _T]) -> _T:
        """Other work of the one writer, a transaction between two batches.

        Raises:
            HopError: the database is away.
            DataFileError: it cannot be used.
        """
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._store.run, work)

    # --- the one writer -----------------------------------------------------------

    async def run(self) -> None:
        """Write until cancelled or closed; call ``close`` afterwards."""
        await asyncio.to_thread(self._journal.keep_reserve)
        while not self._closing:
            await self._gather()
            await self._round()

    async def close(self) -> None:
        """Store or journal the rest, and close the database."""
        self._closing = True
        self._awake.set()
        self._full.set()
        if self._writing is not None:
            await asyncio.wait({self._writing})
        while len(self._queue) and self._lost_since is None:
            await self._write_batch(self._queue.dequeue(_BATCH))
        await self._spill()
        self._lost_at_close += len(self._queue.dequeue(len(self._queue)))
        await asyncio.get_running_loop().run_in_executor(
            self._thread, self._store.close
        )
        self._thread.shutdown(wait=False)
        self._journal_thread.shutdown(wait=False)

    async def _gather(self) -> None:
        """Wait for work, then a moment longer so that a batch is worth its commit."""
        await self._awake.wait()
        self._awake.clear()
        try:
            await asyncio.wait_for(self._full.wait(), _GATHER_S)
        except TimeoutError:
            return
        finally:
            self._full.clear()

    async def _round(self) -> None:
        batch = self._queue.dequeue(_BATCH)
        self._writing = asyncio.create_task(
            self._write_batch(batch), name="history-batch"
        )
        # Cancelling us must not lose sight of a batch that the thread still writes.
        while not self._writing.done():
            await asyncio.wait({self._writing}, timeout=_GATHER_S)
            if self._lost_since is not None:
                await self._spill()
        if self._lost_since is not None:
            await self._rest()
        if len(self._queue):
            self._awake.set()
        if len(self._queue) >= _BATCH:
            self._full.set()

    async def _rest(self) -> None:
        pause, self._pause_s = self._pause_s, min(_LONGEST_PAUSE_S, 2 * self._pause_s)
        self._awake.set()
        while pause > 0.0 and not self._closing:
            await asyncio.sleep(_GATHER_S)
            await self._spill()
            pause -= _GATHER_S

    async def _write_batch(self, batch: list[Waiting]) -> None:
        loop = asyncio.get_running_loop()
        try:
            await loop.run_in_executor(self._thread, self._write, batch)
        except (HopError, DataFileError) as error:
            self._lose(str(error))
        except Exception as error:
            # Whatever memory stumbles over, it must not take the STOP along.
            _log.exception("history: an error of our own")
            self._lose(repr(error))
        else:
            self._written += len(batch)
            self._caught_up.set()
            self._come_back()
            return
        self._queue.put_back(batch)
        await self._spill()

    def _write(self, batch: list[Waiting]) -> None:
        """Write in the thread; the journal's rows are older, so they go first."""
        position = 0
        while position < (end := self._journal.size):
            rows, position = self._journal.read(position, _BATCH)
            self._store.write(rows)
            self._replayed += len(rows)
            if position >= end and self._journal.clear(position):
                break
        if batch:
            self._store.write(batch)

    # --- away and back ------------------------------------------------------------

    def _lose(self, detail: str) -> None:
        if self._lost_since is None:
            self._lost_since = self._clock().mono
            _log.warning("history: database lost, keeping what matters: %s", detail)
        self._detail = detail

    def _come_back(self) -> None:
        if self._lost_since is not None:
            away = self._clock().mono - self._lost_since
            _log.info("history: database is back after %.1f s", away)
        self._lost_since, self._detail = None, ""
        self._pause_s = _FIRST_PAUSE_S

    async def _spill(self) -> None:
        """Move records that may not be lost from memory to the journal."""
        kept = self._queue.dequeue_kept(len(self._queue))
        safe = not kept
        try:
            safe = safe or await self._append(kept)
        finally:
            # Cancelled half-way counts as not done: twice is harmless, never is not.
            if not safe:
                self._queue.put_back(kept)

    async def _append(self, rows: list[Waiting]) -> bool:
        try:
            loop = asyncio.get_running_loop()
            await loop.run_in_executor(self._journal_thread, self._journal.append, rows)
        except HopError as error:
            self._detail = str(error)
            return False
        self._journalled += len(rows)
        self._awake.set()
        return True

    # --- the queue ----------------------------------------------------------------

    def _stamp(self, record: Record) -> Waiting:
        now = self._clock()
        # The wall clock orders states across restarts, the count within one run.
        self._revision = max(self._revision + 1, int(now.wall * 1e9))
        return Waiting(record, self._revision, now.mono)


def journal_file(database_url: str, directory: Path) -> Path:
    """Spill file of a database: beside an SQLite file, else in a directory.

    Raises:
        SettingsError: the address cannot be used.
    """
    file = sqlite_file(database_url)
    if file is None:
        return directory / "history.spill_file"
    return file.with_name(file.name + ".journal")
