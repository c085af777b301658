"""Selection and order of entities: simple queries and ``orderBy``."""

import operator
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import orjson

from iveg.lab.embedded.entities import Entity
from iveg.lab.embedded.orion_text import bad_request, not_supported

_STATEMENT = re.compile(r"([^=!<>~:.]+)(?:(==|!=|>=|<=|>|<)([^,]+))?")
_COMPARISONS: Mapping[str, Callable[[Any, Any], bool]] = {
    "==": operator.eq,
    "!=": operator.ne,
    ">=": operator.ge,
    "<=": operator.le,
    ">": operator.gt,
    "<": operator.lt,
}


def matches_query(entity: Entity, query: str) -> bool:
    """Whether an entity fulfils every statement of ``?q=``.

    A statement is the name of an attribute, or compares one with a number or a text.

    Raises:
        NgsiError: 501, any other statement.
    """
    return all(_fulfils(entity, one) for one in query.split(";") if one)


def _fulfils(entity: Entity, statement: str) -> bool:
    found = _STATEMENT.fullmatch(statement)
    if found is None or ".." in statement:
        raise not_supported(f"the query {statement}")
    name, comparison, operand = found.groups()
    attribute = entity.attributes.get(name)
    if attribute is None or comparison is None:
        return attribute is not None
    value, wanted = orjson.loads(attribute.json), _read(operand)
    comparable = str if isinstance(wanted, str) else int | float
    if not isinstance(value, comparable):
        return comparison == "!="
    return _COMPARISONS[comparison](value, wanted)


def _read(text: str) -> float | str:
    """The operand: a number where it is one, else a text, with or without quotes."""
    try:
        return float(text)
    except ValueError:
        return text.strip("'")


def ordered(entities: Iterable[Entity], order: str) -> list[Entity]:
    """Entities in the order of ``?orderBy=``; ``!`` before a name reverses it.

    Raises:
        NgsiError: 400, a name comes twice.
    """
    entities = list(entities)
    tokens = [one for one in order.split(",") if one]
    if len({one.removeprefix("!") for one in tokens}) < len(tokens):
        raise bad_request("duplicate orderBy token detected")
    for token in reversed(tokens):
        name = token.removeprefix("!")
        entities.sort(key=lambda one: _rank(one, name), reverse=name != token)
    return entities


def _rank(entity: Entity, name: str) -> tuple[int, float, str]:
    """MongoDB's order: absent and null values come before all others."""
    if name in ("id", "type"):
        return 2, 0.0, str(getattr(entity, name))
    attribute = entity.attributes.get(name)
    value = None if attribute is None else orjson.loads(attribute.json)
    if value is None:
        return 0, 0.0, ""
    if isinstance(value, int | float):
        return 1, float(value), ""
    return 2, 0.0, value if isinstance(value, str) else orjson.dumps(value).decode()
