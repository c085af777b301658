"""Rounding that SQLite and PostgreSQL do alike."""

from typing import Any

from sqlalchemy import ColumnElement, Connection, Integer, cast, func


def whole(connection: Connection, value: ColumnElement[Any]) -> ColumnElement[int]:
    """Rounded down: a cast does that on SQLite, and rounds to nearest on PostgreSQL."""
    if connection.dialect.name == "sqlite":
        return cast(value, Integer)
    return cast(func.floor(value), Integer)
