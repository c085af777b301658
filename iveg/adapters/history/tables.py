"""The history as tables, the same on SQLite and PostgreSQL.

A column's key is the field of its record, so that a row and a record are the same
words.  Facts have a number that only grows; ``(robot_id, at)`` answers "what did this
robot do then", which time travel, retention and charts all ask.  ``revision`` lets the
newest state of a decision, command or alert win in whatever order states arrive.
"""

from typing import Any

from sqlalchemy import (
    BigInteger,
    Boolean,
    Column,
    ColumnElement,
    Double,
    Index,
    Integer,
    MetaData,
    Table,
    Text,
    UniqueConstraint,
    and_,
    false,
    or_,
)
from sqlalchemy.types import TypeEngine

from iveg.adapters.history.json_column import JsonValue
from iveg.domain.goals import OPEN_STATES

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
    Column("late", Boolean, nullable=False, server_default=false()),
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
    Column("drill", Boolean, nullable=False, server_default=false()),
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
    _json("members", list),
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
    Column("late", Boolean, nullable=False, server_default=false()),
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


latency = Table(
    "latency",
    metadata,
    _row_id(),
    _number("at", null=False),
    *_texts("robot_id", "data", "hop"),
    Column("count", BigInteger, nullable=False),
    *_numbers("total_s", "least_s", "most_s"),
    _text("bins", null=False),
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
    Column("seq", _BIG, primary_key=True, autoincrement=False),
    _text("audit_id", null=False),
    *_numbers("at", "stored_at"),
    *_texts("person", "name", "role", "method", "action", "subject"),
    # Text, not JSON: its very bytes are hashed.
    *_texts("details", "previous_hash", "hash"),
    UniqueConstraint("audit_id"),
    Index(None, "at", "seq"),
)
"""Triggers of its migration refuse changes, and deletions beyond ``audit_sealed``."""

audit_sealed = Table(
    "audit_sealed",
    metadata,
    Column("seq", _BIG, primary_key=True, autoincrement=False),
    _text("hash", null=False),
    _number("at", null=False),
)
"""Ends of segments that retention takes: the row, its hash, when it was sealed."""

audit_end = Table(
    "audit_end",
    metadata,
    Column("one", Integer, primary_key=True, autoincrement=False),
    Column("seq", BigInteger, nullable=False),
    _text("hash", null=False),
    _number("at", null=False),
)
"""The newest row that was ever written: one row, so that a lost last one is noticed."""


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
    _text("pin", null=False),
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


passkeys = Table(
    "passkeys",
    metadata,
    Column("credential_id", Text, primary_key=True),
    *_texts("account_id", "name", "rp_id", "public_key"),
    Column("sign_count", BigInteger, nullable=False),
    _number("made_at", null=False),
    _number("used_at"),
)


def is_open_command() -> ColumnElement[bool]:
    """Whether the last row of a command says that it still goes on."""
    c = commands.c
    stops = and_(c.kind == "stop", c.state.not_in(("RUNNING", "REPLACED", "EXPIRED")))
    goals = and_(c.kind == "goal", c.state.in_(OPEN_STATES))
    # A release that was refused or confirmed keeps the state that followed.
    return or_(stops, and_(c.kind != "stop", c.state == "RELEASING"), goals)
