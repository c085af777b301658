"""Upkeep of the history: deletes old rows, in pieces of a transaction each.

Once a minute the disk is checked, too.  Where it is low, an alert is raised, and the
oldest recordings of inputs are deleted early.
"""

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import (
    Connection,
    Table,
    TextClause,
    and_,
    delete,
    func,
    null,
    select,
    text,
    true,
    update,
)

from iveg.adapters.files import disk_errors, disk_space
from iveg.adapters.history import tables
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.history.tables import (
    AGES,
    OPEN,
    log,
    metadata,
)
from iveg.domain.audit import ITSELF
from iveg.domain.errors import HopError
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.retention import DAY_S, PURGE_STEPS, DiskSpace, PurgeStep, Retention
from iveg.vital.audit import AuditTrail
from iveg.vital.event_log import EventLog
from iveg.vital.ports import Clock
from iveg.vital.supervision import Supervision

PIECE = 10_000
"""Rows of a transaction; more where many rows have the same time."""

_GUARD = "audit_no_delete"


def purge_piece(connection: Connection, step: PurgeStep, before: float) -> int:
    """Purge the oldest rows of a step, within the caller's transaction.

    Args:
        connection: Connection of the one writer.
        step: Table, and what it loses: rows or positions.
        before: Upper bound of the rows' time (Unix s).

    Returns:
        Number of changed rows; fewer than a piece: nothing is left to do.
    """
    table, at = metadata.tables[step.table], AGES[step.table]
    dialect = connection.dialect.name
    # Open rows are kept at any age.
    condition = ~OPEN[table] if table in OPEN else true()
    if step.kind == "positions":
        condition = tables.PLACED[step.table].dialect_options[dialect]["where"]
    is_old = and_(at < before, condition)
    last = select(at).where(is_old).order_by(at).offset(PIECE - 1).limit(1)
    until = connection.scalar(last)
    # By time: a DELETE has no limit of rows.
    if until is not None:
        is_old = and_(at <= until, condition)
    if step.kind == "positions":
        change = update(table).where(is_old).values(_without_place(table, dialect))
        return connection.execute(change).rowcount
    with _deletable(connection, table):
        return connection.execute(delete(table).where(is_old)).rowcount


@contextmanager
def _deletable(connection: Connection, table: Table) -> Iterator[None]:
    """Lift the guard of the audit, which refuses deletions, within a transaction."""
    if table is not tables.audit:
        yield
    elif connection.dialect.name == "postgresql":
        connection.execute(text(f"ALTER TABLE audit DISABLE TRIGGER {_GUARD}"))
        yield
        connection.execute(text(f"ALTER TABLE audit ENABLE TRIGGER {_GUARD}"))
    else:
        made_by = text("SELECT sql FROM sqlite_master WHERE name = :name")
        guard = connection.scalars(made_by, {"name": _GUARD}).one()
        connection.exec_driver_sql(f"DROP TRIGGER {_GUARD}")
        yield
        connection.exec_driver_sql(guard)


def _without_place(table: Table, dialect: str) -> dict[str, Any]:
    if table is tables.log:
        return {"slots": _pruned("slots", ("x", "y"), dialect)}
    nothing = {name: null() for name in ("x", "y", "z")}
    if table is tables.detections:
        return nothing | {"box": null()}
    places = _pruned("rule_parameters", ("places",), dialect)
    return nothing | {"rule_parameters": places}


def _pruned(column: str, members: tuple[str, ...], dialect: str) -> TextClause:
    """SQL of an object without some members; a damaged object becomes empty."""
    if dialect == "sqlite":
        paths = ", ".join(f"'$.{name}'" for name in members)
        pruned, is_object = f"json_remove({column}, {paths})", f"json_valid({column})"
    else:
        pruned = " - ".join((column, *(f"'{name}'" for name in members)))
        is_object = f"jsonb_typeof({column}) = 'object'"
    return text(f"CASE WHEN {is_object} THEN {pruned} ELSE '{{}}' END")


def recorded_days(connection: Connection, most: int) -> tuple[int, ...]:
    """Days (UTC, since 1970) with a line in the log, newest first."""
    days: list[int] = []
    newest = select(func.max(log.c.at))
    # A query for each day hops over the index; a single query would read all rows.
    while len(days) < most:
        if days:
            newest = select(func.max(log.c.at)).where(log.c.at < days[-1] * DAY_S)
        at = connection.scalar(newest)
        if at is None:
            break
        days.append(int(at // DAY_S))
    return tuple(days)


# --- once a day, and once a minute ----------------------------------------------------

PART = "retention"
LOOK_S = 60.0
SETTLES_S = 300.0
"""Time after the start without a purge (s): a start is busy enough."""
PAUSE_S = 0.1
"""Pause between two pieces (s), in which waiting rows are written."""


class DiskWatch:
    """Raises alerts of a short disk; has the oldest recordings of a low disk deleted.

    Args:
        directory: Data directory, whose disk is watched.
        drop_recording: Deletes the oldest recording of inputs, if there is one.
        is_paused: Whether recordings pause, as the disk is short.
        supervision: Raises the alert.
        read_space: Space on the disk of a directory.
    """

    def __init__(
        self,
        directory: Path,
        drop_recording: Callable[[], Awaitable[bool]],
        is_paused: Callable[[], bool],
        supervision: Supervision,
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self.deleted = 0
        """Recordings deleted since the start."""
        self._directory, self._read_space = directory, read_space
        self._drop_recording, self._is_paused = drop_recording, is_paused
        self._supervision = supervision
        self._is_low = False

    async def look(self) -> None:
        """Check the disk.  Raises HopError: it cannot be read."""
        with disk_errors():
            space = await asyncio.to_thread(self._read_space, self._directory)
        self._is_low = is_low = space.is_low(was_low=self._is_low)
        self._supervision.report(
            PART, space.conditions(is_low=is_low, is_paused=self._is_paused())
        )
        if is_low and await self._drop_recording():
            self.deleted += 1


class HistoryUpkeep:
    """Deletes rows whose retention is over, once a day (UTC).

    Args:
        recorder: Writes to the history.
        queries: Reads the history.
        retention: Days for which each kind of row is kept.
        event_log: Gets a line each day.
        trail: Audit of the deletions.
        disk: Checked once a minute.
    """

    def __init__(
        self,
        recorder: Recorder,
        queries: Queries,
        retention: Retention,
        event_log: EventLog,
        trail: AuditTrail,
        disk: DiskWatch,
    ) -> None:
        self._recorder, self._queries = recorder, queries
        self._retention, self._disk = retention, disk
        self._event_log, self._trail = event_log, trail
        self._rows: Counter[str] = Counter()
        self._settled_at: float | None = None
        self._purged_day: int | None = None

    @property
    def counters(self) -> Mapping[str, int]:
        """Rows deleted and unplaced, and recordings deleted, since the start."""
        rows = {f"history_{outcome}": count for outcome, count in self._rows.items()}
        return rows | {"recordings_deleted": self._disk.deleted}

    async def run(self, clock: Clock) -> None:
        """Check disk and history once a minute until cancelled."""
        while True:
            # The recorder reports a database that is away.
            with suppress(HopError):
                await self._disk.look()
                await self.look(clock())
            await asyncio.sleep(LOOK_S)

    async def look(self, now: Instant) -> None:
        """Purge where it is due.  Raises HopError: the database is away."""
        if self._settled_at is None:
            self._settled_at = now.mono + SETTLES_S
        day = int(now.wall // DAY_S)
        if now.mono >= self._settled_at and day != self._purged_day:
            await self._purge(now)
            # After the purge: after a failure the next attempt comes in a minute.
            self._purged_day = day

    async def _purge(self, now: Instant) -> None:
        recorded = await self._queries.ask(recorded_days, self._retention.longest)
        cutoffs = self._retention.cutoffs(now.wall, recorded)
        slots = {"deleted": 0, "unplaced": 0}
        for step in PURGE_STEPS:
            if step.kind not in cutoffs:
                continue
            before = cutoffs[step.kind]
            outcome = "unplaced" if step.kind == "positions" else "deleted"
            if rows := await self._take(step, before):
                slots[outcome] += rows
                details = {"rows": rows, "before": before}
                self._trail.note(ITSELF, outcome, step.table, details, at=now)
        self._rows.update(slots)
        # By this line a day counts as recorded, even if nothing else happens in it.
        self._event_log.log(LogEvent("system", "log.history_kept", slots), now)

    async def _take(self, step: PurgeStep, before: float) -> int:
        """Purge all rows of a step, piece by piece; returns their number."""
        rows = 0
        piece = partial(purge_piece, step=step, before=before)
        while took := await self._recorder.between_batches(piece):
            rows += took
            await asyncio.sleep(PAUSE_S)
        return rows
