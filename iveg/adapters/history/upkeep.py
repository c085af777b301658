"""Upkeep of the history: rows whose time is over go, in pieces of one transaction each.

Once a minute the disk is looked at, too: where it is low, people are told, and the
oldest recordings of inputs go before their time.
"""

import asyncio
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Literal

from sqlalchemy import (
    ColumnElement,
    Connection,
    Table,
    TextClause,
    and_,
    delete,
    exists,
    func,
    null,
    or_,
    select,
    text,
    true,
    update,
)

from iveg.adapters.files import disk_space
from iveg.adapters.history import tables
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.recorder import Recorder
from iveg.adapters.history.tables import (
    AGES,
    OPEN,
    decisions,
    detections,
    log,
    metadata,
    odometry,
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
"""Rows of one transaction; more where many are of one moment."""

_GUARD = "audit_no_delete"


def purge_piece(connection: Connection, step: PurgeStep, before: float) -> int:
    """Take the oldest rows of a step, within the transaction of the caller.

    Args:
        connection: Of the one writer.
        step: What goes.
        before: Rows that are older than this (Unix s).

    Returns:
        Number of rows that it changed; fewer than a piece: nothing is left to do.
    """
    table, at = metadata.tables[step.table], AGES[step.table]
    dialect = connection.dialect.name
    # What goes on is kept whatever its age.
    which = ~OPEN[table] if table in OPEN else true()
    if step.kind == "positions":
        which = tables.PLACED[step.table].dialect_options[dialect]["where"]
    due = and_(at < before, which)
    last = select(at).where(due).order_by(at).offset(PIECE - 1).limit(1)
    until = connection.scalar(last)
    if until is not None:
        due = and_(at <= until, which)
    if step.kind == "positions":
        change = update(table).where(due).values(_without_place(table, dialect))
        return connection.execute(change).rowcount
    with _deletable(connection, table):
        return connection.execute(delete(table).where(due)).rowcount


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
    """An object without some members; a damaged one, which reads as none, is empty."""
    if dialect == "sqlite":
        paths = ", ".join(f"'$.{one}'" for one in members)
        pruned, is_object = f"json_remove({column}, {paths})", f"json_valid({column})"
    else:
        pruned = " - ".join((column, *(f"'{one}'" for one in members)))
        is_object = f"jsonb_typeof({column}) = 'object'"
    return text(f"CASE WHEN {is_object} THEN {pruned} ELSE '{{}}' END")


def lost_of(
    connection: Connection, since: float, until: float
) -> tuple[Literal["places", "telemetry"], ...]:
    """Kinds of rows no longer kept of ``since <= at < until``, or of a part of it."""
    d, s = detections.c, decisions.c
    decided = and_(s.started_at >= since, s.started_at < until)
    # A decision was about somebody, and its robot drove.
    unplaced = or_(
        exists().where(decided, s.x.is_(None)),
        exists().where(d.at >= since, d.at < until, d.x.is_(None)),
    )
    oldest = select(func.min(odometry.c.at)).scalar_subquery()
    undriven = or_(oldest >= until, exists().where(decided, s.started_at < oldest))
    lost: Mapping[Literal["places", "telemetry"], ColumnElement[bool]] = {
        "places": unplaced,
        "telemetry": undriven,
    }
    return tuple(
        kind for kind, is_lost in lost.items() if connection.scalar(select(is_lost))
    )


def recorded_days(connection: Connection, most: int) -> tuple[int, ...]:
    """Days (UTC, since 1970) with a line in the log, newest first, by hops."""
    days: list[int] = []
    newest = select(func.max(log.c.at))
    while len(days) < most:
        if days:
            newest = select(func.max(log.c.at)).where(log.c.at < days[-1] * DAY_S)
        found = connection.scalar(newest)
        if found is None:
            break
        days.append(int(found // DAY_S))
    return tuple(days)


# --- once a day, and once a minute ----------------------------------------------------

PART = "retention"
LOOK_S = 60.0
SETTLES_S = 300.0
"""A server that has just started has other things to do."""
PAUSE_S = 0.1
"""Between two pieces: rows that wait to be written come in between."""


class DiskWatch:
    """Tells people of a disk that is low, and has the oldest recordings go.

    Args:
        directory: Of the data, whose disk is watched.
        drop_recording: Deletes the oldest recording of inputs, if there is one.
        supervision: Told of a disk that is low.
        read_space: Room on the disk of a directory.
    """

    def __init__(
        self,
        directory: Path,
        drop_recording: Callable[[], Awaitable[bool]],
        supervision: Supervision,
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self.deleted = 0
        """Recordings since the start."""
        self._directory = directory
        self._drop_recording = drop_recording
        self._supervision = supervision
        self._read_space = read_space
        self._is_low = False

    async def look(self) -> None:
        """Look at the disk.  Raises HopError: it cannot be read."""
        try:
            space = await asyncio.to_thread(self._read_space, self._directory)
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error
        self._supervision.report(PART, space.conditions(was_low=self._is_low))
        self._is_low = space.is_low(was_low=self._is_low)
        if self._is_low and await self._drop_recording():
            self.deleted += 1


class HistoryUpkeep:
    """Has rows leave the history when their time is over, once a day (UTC).

    Args:
        recorder: The one writer.
        queries: Its reading side.
        retention: Days that each kind of row is kept.
        event_log: Gets a line a day.
        trail: Told what was deleted.
        disk: Looked at once a minute.
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
        self._recorder = recorder
        self._queries = queries
        self._retention = retention
        self._event_log = event_log
        self._trail = trail
        self._disk = disk
        self._rows: Counter[str] = Counter()
        self._settled_at: float | None = None
        self._purged_day: int | None = None

    @property
    def counters(self) -> Mapping[str, int]:
        """Rows deleted and unplaced, and recordings deleted, since the start."""
        rows = {f"history_{done}": count for done, count in self._rows.items()}
        return rows | {"recordings_deleted": self._disk.deleted}

    async def run(self, clock: Clock) -> None:
        """Until cancelled."""
        while True:
            # A database that is away is the recorder's to report.
            with suppress(HopError):
                await self._disk.look()
                await self.look(clock())
            await asyncio.sleep(LOOK_S)

    async def look(self, now: Instant) -> None:
        """Purge where that is due.  Raises HopError: the database is away."""
        if self._settled_at is None:
            self._settled_at = now.mono + SETTLES_S
        day = int(now.wall // DAY_S)
        if now.mono >= self._settled_at and day != self._purged_day:
            await self._purge(now)
            # Where the database fails before, the day is taken up at the next look.
            self._purged_day = day

    async def _purge(self, now: Instant) -> None:
        recorded = await self._queries.ask(recorded_days, self._retention.longest)
        cutoffs = self._retention.cutoffs(now.wall, recorded)
        slots = {"deleted": 0, "unplaced": 0}
        for step in PURGE_STEPS:
            if step.kind not in cutoffs:
                continue
            before = cutoffs[step.kind]
            done = "unplaced" if step.kind == "positions" else "deleted"
            if rows := await self._take(step, before):
                slots[done] += rows
                details = {"rows": rows, "before": before}
                self._trail.note(ITSELF, done, step.table, details, at=now)
        self._rows.update(slots)
        # By this line a day is recorded also where nothing else happens.
        self._event_log.log(LogEvent("system", "log.history_kept", slots), now)

    async def _take(self, step: PurgeStep, before: float) -> int:
        """All rows of a step, a piece after the other; their number."""
        rows = 0
        piece = partial(purge_piece, step=step, before=before)
        while took := await self._recorder.between_batches(piece):
            rows += took
            await asyncio.sleep(PAUSE_S)
        return rows
