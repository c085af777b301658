"""A JSON column that hands out values: PostgreSQL's own type, SQLite's text."""

from typing import Any

import orjson
from sqlalchemy import JSON, Dialect, Text
from sqlalchemy.dialects.postgresql import JSONB
from sqlalchemy.types import TypeDecorator, TypeEngine


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
