"""Rows whose time is over leave the history, a few milliseconds of writing at a time.

A batch is one transaction of small statements.  It ends when nothing is left or the
bound is reached, so that the recorder's next batch, and another program that writes to
the same file, wait no longer than that.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from sqlalchemy import (
    Column,
    ColumnElement,
    Connection,
    Delete,
    Index,
    Select,
    Table,
    TextClause,
    Update,
    and_,
    delete,
    func,
    null,
    select,
    text,
    true,
    tuple_,
    update,
)

from iveg.adapters import clock
from iveg.adapters.history import partial_indexes, tables
from iveg.adapters.history.audit import is_over, seal
from iveg.adapters.history.day_partitions import drop_day, is_partitioned, over_before
from iveg.domain.retention import PurgeStep

BOUND_S = 0.015
"""A batch begins no statement later than this: the last one and the commit come on
top, and 20 ms are told."""
CHUNK = 50
"""Rows of one statement."""

_Stopwatch = Callable[[], float]
_ROW = {
    "detections": (tables.detections.c.at, tables.detections.c.row_id),
    "decisions": (tables.decisions.c.started_at, tables.decisions.c.decision_id),
    "log": (tables.log.c.at, tables.log.c.row_id),
    "odometry": (tables.odometry.c.at, tables.odometry.c.row_id),
    "climate": (tables.climate.c.at, tables.climate.c.row_id),
    "readings": (tables.readings.c.at, tables.readings.c.row_id),
    "measurements": (tables.measurements.c.at, tables.measurements.c.row_id),
    "commands": (tables.commands.c.requested_at, tables.commands.c.command_id),
    "alerts": (tables.alerts.c.last_raised_at, tables.alerts.c.alert_id),
    "command_events": (tables.command_events.c.at, tables.command_events.c.row_id),
    "latency": (tables.latency.c.at, tables.latency.c.row_id),
    "audit": (tables.audit.c.at, tables.audit.c.seq),
    "audit_sealed": (tables.audit_sealed.c.at, tables.audit_sealed.c.seq),
    "api_tokens": (tables.api_tokens.c.made_at, tables.api_tokens.c.token_id),
    "passkeys": (tables.passkeys.c.made_at, tables.passkeys.c.credential_id),
    "accounts": (tables.accounts.c.since, tables.accounts.c.account_id),
    "audit_end": (tables.audit_end.c.at, tables.audit_end.c.one),
}
"""Table → the column by which its rows age, and its key."""
_OVER: Mapping[str, ColumnElement[bool]] = {
    # What goes on is kept whatever its age; drills are the proof that STOP was tried.
    "decisions": tables.decisions.c.ended_at.is_not(None),
    "commands": and_(~tables.is_open_command(), ~tables.commands.c.drill),
    "alerts": tables.alerts.c.cleared_at.is_not(None),
}
_PLACED: Mapping[str, Index] = {
    "detections": partial_indexes.placed_detections,
    "decisions": partial_indexes.placed_decisions,
    "log": partial_indexes.placed_lines,
}
"""Table → the index of those of its rows that have a place."""


@dataclass(frozen=True, slots=True)
class PurgeBatch:
    """What one batch did; ``is_last``: nothing is left to do."""

    rows: int
    is_last: bool


def age_of(table: str) -> Column[float]:
    """The column by which the rows of a table age (Unix s)."""
    return cast("Column[float]", _ROW[table][0])


def purge_batch(
    connection: Connection, step: PurgeStep, before: float, stopwatch: _Stopwatch
) -> PurgeBatch:
    """Take the oldest rows of a step, within the transaction of the caller.

    Args:
        connection: Of the one writer.
        step: What goes.
        before: Rows that are older than this (Unix s).
        stopwatch: Monotonic (s).
    """
    if step.table == "audit":
        seal(connection, before, clock.wall())
    if step.kind == "telemetry":
        dropped = drop_day(connection, step.table, before)
        if dropped is not None:
            return PurgeBatch(dropped, is_last=False)
        before = over_before(connection, step.table, before)
    statement = _statement(connection, step, before)
    began, rows = stopwatch(), 0
    while True:
        found = connection.execute(statement).rowcount
        rows += found
        if found < CHUNK or stopwatch() - began >= BOUND_S:
            return PurgeBatch(rows, found < CHUNK)


def count_due(connection: Connection, step: PurgeStep, before: float) -> int:
    """Number of rows that a step would change."""
    if step.kind == "telemetry":
        before = over_before(connection, step.table, before)
    due = _due(connection, step, before)
    return connection.scalar(select(func.count()).select_from(due.subquery())) or 0


def give_back(connection: Connection, stopwatch: _Stopwatch) -> PurgeBatch:
    """Return free pages of an SQLite file to the disk; ``rows`` counts pages.

    A file of an earlier version keeps its pages until ``iveg db vacuum``.
    """
    if connection.dialect.name != "sqlite":
        return PurgeBatch(0, is_last=True)
    # Python fetches one page of the statement and no more, whatever it asks for.
    began, before = stopwatch(), _free_pages(connection)
    left = before
    while left and stopwatch() - began < BOUND_S:
        connection.exec_driver_sql("PRAGMA incremental_vacuum(1)")
        after = _free_pages(connection)
        if after == left:
            return PurgeBatch(before - left, is_last=True)
        left = after
    return PurgeBatch(before - left, is_last=left == 0)


def room_inside(connection: Connection) -> int:
    """Bytes of an SQLite file that new rows fill before it grows."""
    size = connection.exec_driver_sql("PRAGMA page_size").scalar() or 0
    return _free_pages(connection) * int(size)


def _free_pages(connection: Connection) -> int:
    return int(connection.exec_driver_sql("PRAGMA freelist_count").scalar() or 0)


def _statement(
    connection: Connection, step: PurgeStep, before: float
) -> Delete | Update:
    table, dialect = tables.metadata.tables[step.table], connection.dialect.name
    some = _due(connection, step, before).limit(CHUNK)
    due = tuple_(*some.selected_columns).in_(some)
    if step.kind != "positions":
        return delete(table).where(due)
    return update(table).where(due).values(_without_place(table, dialect))


def _due(connection: Connection, step: PurgeStep, before: float) -> Select[Any]:
    """Keys of the rows of a step, oldest first."""
    at, key = age_of(step.table), _ROW[step.table][1]
    if step.table == "audit":
        return select(key).where(is_over(before)).order_by(key)
    which = _OVER.get(step.table, true())
    if step.kind == "positions":
        dialect = connection.dialect.name
        which = _PLACED[step.table].dialect_options[dialect]["where"]
    # A day's table is found by the time, and has no index of keys alone.
    keys = (at, key) if is_partitioned(connection, step.table) else (key,)
    return select(*keys).where(at < before, which).order_by(at)


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
