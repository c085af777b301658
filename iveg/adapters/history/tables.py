"""Tables of the history, the same on SQLite and PostgreSQL.

The columns of a table are those of its record (``domain.records``); keys, indexes and
the order of rows stand here.  Facts have a number that only grows.  The index
``(robot_id, at)`` serves time travel, retention and charts.  By ``revision`` the newest
state of a decision, command or alert wins, in whatever order states arrive.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, get_origin

import orjson
from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Column,
    ColumnElement,
    Dialect,
    Double,
    Index,
    Integer,
    MetaData,
    Table,
    Text,
    UniqueConstraint,
    and_,
    or_,
    text,
)
from sqlalchemy.dialects.postgresql import JSONB
from sqlalchemy.types import TypeDecorator, TypeEngine

from iveg.domain import records
from iveg.domain.goals import OPEN_STATES
from iveg.domain.records import (
    COLUMNS,
    AlertRecord,
    AuditRecord,
    ClimateRecord,
    ColumnType,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
    Record,
)


class JsonValue(TypeDecorator[Any]):
    """JSON: JSONB in PostgreSQL, text in SQLite.

    Damaged JSON, or JSON of another shape, reads as null: a bad row must not hide a
    list.

    Attributes:
        shape: Type of the value, ``dict`` or ``list``.
    """

    impl = JSON
    cache_ok = True

    def __init__(
        self, shape: type[dict[str, object]] | type[list[object]] = dict
    ) -> None:
        super().__init__()
        self.shape = shape

    def load_dialect_impl(self, dialect: Dialect) -> TypeEngine[Any]:
        """Type of the column in the database."""
        kind: TypeEngine[Any] = Text() if dialect.name == "sqlite" else JSONB()
        return dialect.type_descriptor(kind)

    def process_bind_param(self, value: object, dialect: Dialect) -> object:
        """Convert a value for the database."""
        return orjson.dumps(value).decode() if dialect.name == "sqlite" else value

    def process_result_value(self, value: Any, dialect: Dialect) -> object:
        """Convert a value of the database."""
        with suppress(orjson.JSONDecodeError):
            if dialect.name == "sqlite" and value is not None:
                value = orjson.loads(value)
        return value if isinstance(value, self.shape) else None


metadata = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)

_BIG: TypeEngine[int] = BigInteger().with_variant(Integer(), "sqlite")
_TYPES: dict[ColumnType, type[TypeEngine[Any]]] = {
    "time": Double,
    "number": Double,
    "integer": Integer,
    "flag": Boolean,
    "text": Text,
}


@dataclass(frozen=True, slots=True, eq=False)
class TableMapping:
    """Table of one kind of record.

    Attributes:
        identity: Columns that name the thing or fact; empty where every row is new.
        changes: Whether a later record replaces an earlier one.
        at: Time of a row (Unix s), which orders lists and decides its age.
        key: Order of rows with the same time.
    """

    table: Table
    identity: tuple[str, ...]
    changes: bool
    at: Column[Any]
    key: Column[Any]


TABLE_MAPPINGS: dict[type[Any], TableMapping] = {}


def _table(
    name: str,
    kind: type[Record],
    *beside: Column[Any] | Index | UniqueConstraint,
    identity: Sequence[str] = (),
    at: str = "at",
    key: str = "row_id",
) -> Table:
    """Make and register the table of a kind of record.

    Args:
        name: Name of the table.
        kind: Record with its columns.
        beside: Its indexes, and columns that only earlier versions filled.
        identity: See ``TableMapping``.
        at: See ``TableMapping``.
        key: Primary key: a column of the record, by which a later row replaces an
            earlier one, or else a number.
    """
    columns = [_column(column, key, identity) for column in COLUMNS[kind]]
    changes = key in {column.key for column in columns}
    if changes:
        columns.append(Column("revision", BigInteger, nullable=False))
    else:
        columns.insert(0, Column(key, _BIG, primary_key=True, autoincrement=True))
    # A number is never used again: a cursor would point at another row.
    is_counted = key == "row_id"
    table = Table(name, metadata, *columns, *beside, sqlite_autoincrement=is_counted)
    order = table.c[at], table.c[key]
    TABLE_MAPPINGS[kind] = TableMapping(table, tuple(identity), changes, *order)
    return table


def _column(row: records.Column, key: str, identity: Sequence[str]) -> Column[Any]:
    type_: TypeEngine[Any] | type[TypeEngine[Any]]
    if row.type == "json":
        type_ = JsonValue(list if get_origin(row.hint) is Sequence else dict)
    elif row.type == "integer" and row.key in identity:
        type_ = BigInteger
    else:
        type_ = _TYPES[row.type]
    return Column(
        row.name, type_, key=row.key, nullable=row.may_lack, primary_key=row.key == key
    )


decisions = _table(
    "decisions",
    DecisionRecord,
    Index(None, "started_at", "decision_id"),
    Index(None, "robot_id", "started_at"),
    identity=["decision_id"],
    at="started_at",
    key="decision_id",
)
detections = _table(
    "detections",
    DetectionRecord,
    Index(None, "at", "row_id"),
    Index(None, "robot_id", "at", postgresql_include=["class_id", "probability"]),
)
commands = _table(
    "commands",
    CommandRecord,
    Index(None, "requested_at", "command_id"),
    Index(None, "robot_id", "requested_at"),
    identity=["command_id"],
    at="requested_at",
    key="command_id",
)
# Unique: a step may come twice, from the queue and from the journal after a restart.
command_events = _table(
    "command_events",
    CommandEventRecord,
    UniqueConstraint("command_id", "at", "state", "why"),
    Index(None, "robot_id", "at"),
    Index(None, "at"),
    identity=["command_id", "at", "state", "why"],
)
alerts = _table(
    "alerts",
    AlertRecord,
    Index(None, "last_raised_at", "alert_id"),
    Index(None, "robot_id", "raised_at"),
    identity=["alert_id"],
    at="last_raised_at",
    key="alert_id",
)
log = _table(
    "log",
    LogRecord,
    UniqueConstraint("id", "at"),
    Index(None, "at", "row_id"),
    Index(None, "robot_id", "at"),
    identity=["id", "at"],
)
_CHARTED = ["linear", "limit_factor", "applied_factor", "margin_m"]
"""Columns in the index, from which a chart of a robot's day reads them: a page of the
table holds only a few of its rows."""
odometry = _table(
    "odometry",
    OdometryRecord,
    Column("margin_m", Double),
    Index(None, "robot_id", "at", postgresql_include=_CHARTED),
    Index(None, "at"),
)
climate = _table("climate", ClimateRecord, Index(None, "at"))
readings = _table(
    "readings",
    ReadingRecord,
    Index(None, "at", "row_id"),
    Index(None, "robot_id", "at"),
)
measurements = _table(
    "measurements",
    MeasurementRecord,
    Index(None, "at", "row_id"),
    Index(None, "entity_id", "attribute", "at"),
)
audit = _table(
    "audit",
    AuditRecord,
    UniqueConstraint("audit_id"),
    Index(None, "at", "seq"),
    identity=["audit_id"],
    key="seq",
)
"""Triggers in its migrations refuse changes and deletions (``upkeep``)."""


def _placed(table: Table, at: str, sqlite: str, postgresql: str) -> Index:
    """Index of rows that still have a position, by which retention finds them.

    A database uses it for queries with the same condition, word for word.
    """
    return Index(
        f"ix_{table.name}_placed",
        table.c[at],
        sqlite_where=text(sqlite),
        postgresql_where=text(postgresql),
    )


PLACED = {
    "detections": _placed(detections, "at", "x IS NOT NULL", "x IS NOT NULL"),
    "decisions": _placed(decisions, "started_at", "x IS NOT NULL", "x IS NOT NULL"),
    "log": _placed(log, "at", "instr(slots, '\"x\":') > 0", "slots ? 'x'"),
}


EARLIER = "accounts", "api_tokens", "access_moved"
"""Tables of earlier versions, whose rows are copied once."""
AGES: dict[str, Column[Any]] = {
    mapping.table.name: mapping.at for mapping in TABLE_MAPPINGS.values()
}
"""Table → the column by which its rows age (Unix s)."""


def _is_open_command() -> ColumnElement[bool]:
    c = commands.c
    stops = and_(c.kind == "stop", c.state.not_in(("RUNNING", "REPLACED", "EXPIRED")))
    goals = and_(c.kind == "goal", c.state.in_(OPEN_STATES))
    # A release that was refused or confirmed keeps the state that followed.
    return or_(stops, and_(c.kind != "stop", c.state == "RELEASING"), goals)


OPEN: Mapping[Table, ColumnElement[bool]] = {
    decisions: decisions.c.ended_at.is_(None),
    commands: _is_open_command(),
    alerts: alerts.c.cleared_at.is_(None),
}
"""Condition of open rows in a table, by their last state."""
