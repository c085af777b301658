"""The history as tables, the same on SQLite and PostgreSQL.

A column's key is the field of its record, so that a row and a record are the same
words.  Facts have a number that only grows; ``(robot_id, at)`` answers "what did this
robot do then", which time travel, retention and charts all ask.  ``revision`` lets the
newest state of a decision, command or alert win in whatever order states arrive.

A JSON column that hands out values: PostgreSQL's own type, SQLite's text.

Which record is a row of which table.
"""

from dataclasses import dataclass
from typing import Any

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
)
from sqlalchemy.dialects.postgresql import JSONB
from sqlalchemy.types import TypeDecorator, TypeEngine

from iveg.domain.goals import OPEN_STATES
from iveg.domain.records import (
    AlertRecord,
    AuditRecord,
    ClimateRecord,
    CommandEventRecord,
    CommandRecord,
    DecisionRecord,
    DetectionRecord,
    LogRecord,
    MeasurementRecord,
    OdometryRecord,
    ReadingRecord,
)


class JsonValue(TypeDecorator[Any]):
    """JSON as PostgreSQL keeps it (JSONB); in SQLite, whose JSON is text, its text.

    What is damaged, or JSON of another shape, reads as null: one bad row must not hide
    a list.

    Attributes:
        shape: ``dict`` or ``list``, of what is kept.
    """

    impl = JSON
    cache_ok = True

    def __init__(
        self, shape: type[dict[str, object]] | type[list[object]] = dict
    ) -> None:
        super().__init__()
        self.shape = shape

    def load_dialect_impl(self, dialect: Dialect) -> TypeEngine[Any]:
        """What the database knows."""
        kind: TypeEngine[Any] = Text() if dialect.name == "sqlite" else JSONB()
        return dialect.type_descriptor(kind)

    def process_bind_param(self, value: object, dialect: Dialect) -> object:
        """A value on its way in."""
        return orjson.dumps(value).decode() if dialect.name == "sqlite" else value

    def process_result_value(self, value: Any, dialect: Dialect) -> object:
        """A value on its way out."""
        if dialect.name == "sqlite" and value is not None:
            value = _loaded(value)
        return value if isinstance(value, self.shape) else None


def _loaded(text: str) -> object:
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError:
        return None


metadata = MetaData(
    naming_convention={
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "pk": "pk_%(table_name)s",
    }
)

_BIG: TypeEngine[int] = BigInteger().with_variant(Integer(), "sqlite")


def _number(name: str, *, null: bool = True) -> Column[float]:
    return Column(name, Double, nullable=null)


def _text(name: str, *, null: bool = True, key: str | None = None) -> Column[str]:
    return Column(name, Text, nullable=null, key=key or name)


def _texts(*names: str) -> list[Column[str]]:
    """Columns of text that is never missing."""
    return [_text(name, null=False) for name in names]


def _numbers(*names: str) -> list[Column[float]]:
    """Columns of numbers that are never missing."""
    return [_number(name, null=False) for name in names]


def _json(
    name: str,
    shape: type[dict[str, object]] | type[list[object]] = dict,
    *,
    null: bool = False,
) -> Column[Any]:
    return Column(name, JsonValue(shape), nullable=null)


def _row_id() -> Column[int]:
    return Column("row_id", _BIG, primary_key=True, autoincrement=True)


def _revision() -> Column[int]:
    return Column("revision", BigInteger, nullable=False)


decisions = Table(
    "decisions",
    metadata,
    Column("decision_id", Text, primary_key=True),
    *_texts("kind", "robot_id"),
    _number("started_at", null=False),
    _text("person_id"),
    _text("observer"),
    _text("class", key="class_"),
    _text("class_id"),
    *map(_number, ("confidence", "x", "y", "z")),
    *map(_number, ("distance_m", "speed_factor")),
    _text("reason"),
    _text("rule_id"),
    _text("rule_version"),
    _json("rule_parameters"),
    Column("in_sight", Boolean),
    _number("feedback_at"),
    _number("applied_at"),
    _number("observed_at"),
    _number("ended_at"),
    _number("speed_before"),
    _number("speed_after"),
    _json("links", list),
    _revision(),
    Index(None, "started_at", "decision_id"),
    Index(None, "robot_id", "started_at"),
)

detections = Table(
    "detections",
    metadata,
    _row_id(),
    _number("at", null=False),
    *_texts("robot_id", "class_id"),
    _number("probability", null=False),
    *map(_number, ("x", "y", "z")),
    Column("confident", Boolean, nullable=False),
    _text("transport", null=False),
    _text("stamp"),
    _text("class", key="class_"),
    _text("person_id"),
    _json("box", null=True),
    Index(None, "at", "row_id"),
    Index(None, "robot_id", "at", postgresql_include=["class_id", "probability"]),
    sqlite_autoincrement=True,
)

commands = Table(
    "commands",
    metadata,
    Column("command_id", Text, primary_key=True),
    *_texts("robot_id", "kind", "state", "requested_by"),
    _number("requested_at", null=False),
    _json("sent_at"),
    _json("answer_at"),
    _number("standing_at"),
    _number("standstill_ms"),
    Column("tries", Integer, nullable=False),
    _text("reason"),
    _number("pressed_at"),
    _json("goal", null=True),
    _revision(),
    Index(None, "requested_at", "command_id"),
    Index(None, "robot_id", "requested_at"),
)

command_events = Table(
    "command_events",
    metadata,
    _row_id(),
    *_texts("command_id", "robot_id"),
    _number("at", null=False),
    *_texts("state", "why"),
    UniqueConstraint("command_id", "at", "state", "why"),
    Index(None, "robot_id", "at"),
    Index(None, "at"),
    sqlite_autoincrement=True,
)

alerts = Table(
    "alerts",
    metadata,
    Column("alert_id", Text, primary_key=True),
    *_texts("priority", "key"),
    _number("raised_at", null=False),
    _json("slots"),
    _text("robot_id"),
    _number("cleared_at"),
    _number("acknowledged_at"),
    _text("acknowledged_by"),
    _text("note"),
    Column("count", Integer, nullable=False),
    _number("last_raised_at", null=False),
    _revision(),
    Index(None, "last_raised_at", "alert_id"),
    Index(None, "robot_id", "raised_at"),
)

log = Table(
    "log",
    metadata,
    _row_id(),
    Column("id", BigInteger, nullable=False),
    _number("at", null=False),
    *_texts("kind", "key"),
    _json("slots"),
    _text("robot_id"),
    _text("class", key="class_"),
    _text("decision_id"),
    UniqueConstraint("id", "at"),
    Index(None, "at", "row_id"),
    Index(None, "robot_id", "at"),
    sqlite_autoincrement=True,
)

_CHARTED = ["linear", "limit_factor", "applied_factor", "margin_m"]
"""A chart of a robot's day reads them from the index: each page of the table holds a
few of its rows."""

odometry = Table(
    "odometry",
    metadata,
    _row_id(),
    _number("at", null=False),
    _text("robot_id", null=False),
    *_numbers("x", "y", "yaw", "linear", "angular", "limit_factor"),
    _number("applied_factor"),
    _text("link"),
    _number("margin_m"),
    Index(None, "robot_id", "at", postgresql_include=_CHARTED),
    Index(None, "at"),
    sqlite_autoincrement=True,
)

climate = Table(
    "climate",
    metadata,
    _row_id(),
    _number("at", null=False),
    _number("temperature"),
    _number("relative_humidity"),
    _number("co2"),
    Index(None, "at"),
    sqlite_autoincrement=True,
)


readings = Table(
    "readings",
    metadata,
    _row_id(),
    _number("at", null=False),
    *_texts("robot_id", "kind"),
    _json("value"),
    Index(None, "at", "row_id"),
    Index(None, "robot_id", "at"),
    sqlite_autoincrement=True,
)


measurements = Table(
    "measurements",
    metadata,
    _row_id(),
    _number("at", null=False),
    *_texts("entity_id", "attribute"),
    _number("value", null=False),
    _text("unit", null=False),
    Index(None, "at", "row_id"),
    Index(None, "entity_id", "attribute", "at"),
    sqlite_autoincrement=True,
)


audit = Table(
    "audit",
    metadata,
    Column("seq", _BIG, primary_key=True, autoincrement=True),
    _text("audit_id", null=False),
    _number("at", null=False),
    *_texts("person", "name", "role", "method", "action", "subject", "details"),
    UniqueConstraint("audit_id"),
    Index(None, "at", "seq"),
)
"""Triggers of its migrations refuse changes and deletions (``purge.deletable``)."""


accounts = Table(
    "accounts",
    metadata,
    Column("account_id", Text, primary_key=True),
    *_texts("name", "name_key", "role", "password"),
    Column("disabled", Boolean, nullable=False),
    _number("ends_at"),
    _text("invitation", null=False),
    *_numbers("invited_until", "since"),
    _text("provider", null=False),
    _text("language", null=False),
    UniqueConstraint("name_key"),
)


api_tokens = Table(
    "api_tokens",
    metadata,
    Column("token_id", Text, primary_key=True),
    *_texts("name", "name_key", "scope", "digest"),
    _number("made_at", null=False),
    _number("used_at"),
    _number("ends_at"),
    UniqueConstraint("name_key"),
)


access_moved = Table("access_moved", metadata, _number("at", null=False))
"""One row once accounts and tokens are in their own file; both tables go later."""


def is_open_command() -> ColumnElement[bool]:
    """Whether the last row of a command says that it still goes on."""
    c = commands.c
    stops = and_(c.kind == "stop", c.state.not_in(("RUNNING", "REPLACED", "EXPIRED")))
    goals = and_(c.kind == "goal", c.state.in_(OPEN_STATES))
    # A release that was refused or confirmed keeps the state that followed.
    return or_(stops, and_(c.kind != "stop", c.state == "RELEASING"), goals)


@dataclass(frozen=True, slots=True)
class TableMapping:
    """Table of one kind of record.

    Attributes:
        identity: Columns that name the thing or fact; empty where every row is new.
        changes: Whether a later record takes the place of an earlier one.
    """

    table: Table
    identity: tuple[str, ...] = ()
    changes: bool = False


TABLE_MAPPINGS: dict[type, TableMapping] = {
    CommandRecord: TableMapping(commands, ("command_id",), changes=True),
    CommandEventRecord: TableMapping(
        command_events, ("command_id", "at", "state", "why")
    ),
    DecisionRecord: TableMapping(decisions, ("decision_id",), changes=True),
    AlertRecord: TableMapping(alerts, ("alert_id",), changes=True),
    LogRecord: TableMapping(log, ("id", "at")),
    DetectionRecord: TableMapping(detections),
    OdometryRecord: TableMapping(odometry),
    ClimateRecord: TableMapping(climate),
    ReadingRecord: TableMapping(readings),
    MeasurementRecord: TableMapping(measurements),
    AuditRecord: TableMapping(audit, ("audit_id",)),
}
