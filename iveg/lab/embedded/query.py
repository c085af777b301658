"""Selection and order of entities: the simple query language and ``orderBy``."""

import re
from collections.abc import Iterable
from typing import Any

import orjson

from iveg.lab.embedded.entities import Entity
from iveg.lab.embedded.orion_errors import bad_request

_STATEMENT = re.compile(r"(!?)([^=!<>~:]+?)(?:(==|!=|>=|<=|~=|>|<|:)(.*))?")


def matches_query(entity: Entity, query: str) -> bool:
    """Whether an entity fulfils every statement of ``?q=``.

    Not supported: metadata queries and geographical ones.

    Raises:
        NgsiError: 400, not a query.
    """
    return all(_fulfils(entity, one) for one in query.split(";") if one)


def _fulfils(entity: Entity, statement: str) -> bool:
    found = _STATEMENT.fullmatch(statement)
    if found is None:
        raise bad_request("invalid query expression")
    absent, path, operator, operand = found.groups()
    there, value = _value(entity, path.strip())
    if operator is None:
        return there != bool(absent)
    if operator == "!=":
        return there and not _equals(value, operand)
    return there and _compares(value, operator, operand)


def _value(entity: Entity, path: str) -> tuple[bool, Any]:
    name, *rest = path.split(".")
    if name not in entity.attributes:
        return False, None
    value = orjson.loads(entity.attributes[name].json)
    for part in rest:
        if not isinstance(value, dict) or part not in value:
            return False, None
        value = value[part]
    return True, value


def _compares(value: Any, operator: str, operand: str) -> bool:
    if operator in ("==", ":"):
        return _equals(value, operand)
    if operator == "~=":
        return isinstance(value, str) and re.search(operand, value) is not None
    wanted = _read(operand)
    if isinstance(wanted, str) != isinstance(value, str):
        return False
    if not isinstance(value, str | int | float):
        return False
    below, same = bool(value < wanted), bool(value == wanted)
    return {"<": below, "<=": below or same, ">": not (below or same)}.get(
        operator, not below
    )


def _equals(value: Any, operand: str) -> bool:
    if ".." in operand:
        low, _, high = operand.partition("..")
        return _compares(value, ">=", low) and _compares(value, "<=", high)
    return any(value == _read(one) for one in operand.split(","))


def _read(text: str) -> Any:
    if text.startswith("'") and text.endswith("'"):
        return text[1:-1]
    try:
        return orjson.loads(text)
    except orjson.JSONDecodeError:
        return text


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
    if name in ("dateCreated", "dateModified"):
        return 1, entity.created if name == "dateCreated" else entity.modified, ""
    _, value = _value(entity, name)
    if value is None:
        return 0, 0.0, ""
    if isinstance(value, bool):
        return 5, float(value), ""
    if isinstance(value, int | float):
        return 1, float(value), ""
    kind = (str, dict, list).index(type(value)) + 2
    return kind, 0.0, value if isinstance(value, str) else orjson.dumps(value).decode()
