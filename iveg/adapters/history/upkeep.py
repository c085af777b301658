"""Upkeep of the history: rows whose time is over go, in pieces of one transaction each.

Beside it stands what the history holds: its size, its days, and what of a day is gone.
"""

import asyncio
from collections.abc import Callable, Coroutine, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sqlalchemy import (
    ColumnElement,
    Connection,
    Integer,
    Table,
    TextClause,
    and_,
    delete,
    exists,
    func,
    null,
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
    decisions,
    detections,
    log,
    metadata,
    odometry,
)
from iveg.domain.errors import HopError
from iveg.domain.retention import DAY_S, DiskSpace, PurgeStep

PIECE = 10_000
"""Rows of one transaction; more where many are of one moment."""

_OVER: Mapping[str, ColumnElement[bool]] = {
    # What goes on is kept whatever its age.
    "decisions": tables.decisions.c.ended_at.is_not(None),
    "commands": ~tables.is_open_command(),
    "alerts": tables.alerts.c.cleared_at.is_not(None),
}
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
    which = _OVER.get(step.table, true())
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
    unplaced = select(exists().where(decided, s.x.is_(None)))
    unplaced_look = select(exists().where(d.at >= since, d.at < until, d.x.is_(None)))
    driven = connection.scalar(select(func.min(odometry.c.at)))
    lost: list[Literal["places", "telemetry"]] = []
    if any(connection.scalar(one) for one in (unplaced, unplaced_look)):
        lost.append("places")
    if driven is not None:
        unknown = select(exists().where(decided, s.started_at < driven))
        if driven >= until or connection.scalar(unknown):
            lost.append("telemetry")
    return tuple(lost)


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


class RecordedHistory:
    """Implements ``pipeline.retention.RetainedHistory``.

    Args:
        recorder: The one writer.
        queries: Its reading side.
        directory: Of the data, whose disk is watched.
        drop_recording: Deletes the oldest recording of inputs, if there is one.
        read_space: Room on the disk of a directory.
    """

    def __init__(
        self,
        recorder: Recorder,
        queries: Queries,
        directory: Path,
        drop_recording: Callable[[], Coroutine[object, object, bool]],
        read_space: Callable[[Path], DiskSpace] = disk_space,
    ) -> None:
        self._recorder = recorder
        self._directory = directory
        self._read_space = read_space
        self.recorded_days = lambda most: queries.ask(recorded_days, most)
        self.drop_recording = drop_recording

    async def purge(self, step: PurgeStep, before: float) -> int:
        """One piece of a step, of rows older than this (Unix s); number of rows."""
        return await self._recorder.between_batches(
            lambda connection: purge_piece(connection, step, before)
        )

    async def disk_space(self) -> DiskSpace:
        """Room on the disk of the data."""
        try:
            return await asyncio.to_thread(self._read_space, self._directory)
        except OSError as error:
            raise HopError("disk", error.strerror or str(error)) from error


# --- size ----


@dataclass(frozen=True, slots=True)
class TableStats:
    """Rows of one table.

    Attributes:
        oldest: (Unix s); None of an empty table, as ``newest``.
    """

    name: str
    rows: int
    oldest: float | None
    newest: float | None


def read_stats(connection: Connection) -> tuple[list[TableStats], int]:
    """Rows of each table, and the size of all (bytes); reads all of it."""
    found = []
    for name, at in AGES.items():
        measured = select(func.count(), func.min(at), func.max(at))
        found.append(TableStats(name, *connection.execute(measured).one()))
    if connection.dialect.name == "postgresql":
        size = select(func.pg_database_size(func.current_database()))
    else:
        pages = text(
            "SELECT page_count * page_size AS size FROM"
            " pragma_page_count, pragma_page_size"
        )
        size = pages.columns(size=Integer)
    return found, connection.scalar(size) or 0
