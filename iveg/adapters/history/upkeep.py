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
    cast,
    delete,
    exists,
    func,
    null,
    select,
    text,
    true,
    update,
)
from sqlalchemy.exc import OperationalError

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

_MINUTE_S, _HOUR_S = 60.0, 3600.0
_PAGES_OF = """
SELECT m.tbl_name, sum(d.pgsize) FROM dbstat AS d JOIN sqlite_master AS m USING (name)
WHERE d.aggregate = TRUE GROUP BY m.tbl_name
"""
_SIZE_OF = text(
    "SELECT sum(pg_total_relation_size(one)) FROM ("
    "SELECT to_regclass(:name)::oid "
    "UNION SELECT relid FROM pg_partition_tree(to_regclass(:name))) AS parts (one)"
)


@dataclass(frozen=True, slots=True)
class TableStats:
    """Size of one table with its indexes.

    Attributes:
        size: (bytes); where SQLite does not say, the table's share of all rows.
        oldest: (Unix s); None of an empty table, as ``newest``.
        hourly: Bytes for each hour of each robot, of rows since the oldest odometry;
            None without any.
    """

    name: str
    rows: int
    size: int
    oldest: float | None
    newest: float | None
    hourly: float | None


@dataclass(frozen=True, slots=True)
class HistoryStats:
    """Size of the history.

    Attributes:
        tables: The largest first.
        robot_hours: Hours in which odometry of a robot came, of all robots.
    """

    tables: tuple[TableStats, ...]
    robot_hours: float


def read_stats(connection: Connection) -> HistoryStats:
    """Measure the history; reads all of it."""
    counted = {one: _count(connection, one) for one in metadata.sorted_tables}
    sizes = _sizes(connection, {one.name: n for one, n in counted.items()})
    hours = _robot_hours(connection)
    since = connection.scalar(select(func.min(odometry.c.at)))
    found = [
        _stats(connection, table, rows, sizes.get(table.name, 0), since, hours)
        for table, rows in counted.items()
    ]
    return HistoryStats(tuple(sorted(found, key=lambda one: -one.size)), hours)


def _count(connection: Connection, table: Table) -> int:
    return connection.scalar(select(func.count()).select_from(table)) or 0


def _stats(
    connection: Connection,
    table: Table,
    rows: int,
    size: int,
    since: float | None,
    hours: float,
) -> TableStats:
    at = AGES[table.name]
    oldest, newest = (
        connection.scalar(select(one(at))) for one in (func.min, func.max)
    )
    hourly = None
    if hours and rows:
        recent = connection.scalar(select(func.count()).where(at >= since)) or 0
        hourly = size / rows * recent / hours
    return TableStats(table.name, rows, size, oldest, newest, hourly)


def _robot_hours(connection: Connection) -> float:
    # Rounded, not cut, on PostgreSQL: still one for each minute.
    minute = cast(odometry.c.at / _MINUTE_S, Integer)
    each = select(odometry.c.robot_id, minute).distinct().subquery()
    minutes = connection.scalar(select(func.count()).select_from(each)) or 0
    return minutes * _MINUTE_S / _HOUR_S


def _sizes(connection: Connection, rows: dict[str, int]) -> dict[str, int]:
    if connection.dialect.name == "postgresql":
        return {n: int(connection.scalar(_SIZE_OF, {"name": n}) or 0) for n in rows}
    try:
        return {row[0]: row[1] for row in connection.execute(text(_PAGES_OF))}
    except OperationalError:
        # Some builds of SQLite have no size of each table.
        pages, page = (
            connection.exec_driver_sql(f"PRAGMA {one}").scalar() or 0
            for one in ("page_count", "page_size")
        )
        total = max(1, sum(rows.values()))
        return {name: int(pages) * int(page) * n // total for name, n in rows.items()}
