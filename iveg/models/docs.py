"""The page of resources, from the models: ``python -m iveg.models.docs`` prints it."""

import sys
from collections.abc import Iterator
from itertools import groupby
from typing import Final

from pydantic.json_schema import models_json_schema

from iveg.domain.records import Json
from iveg.models.base import Model, in_line
from iveg.models.health import Recording
from iveg.models.history import (
    AcknowledgedAlerts,
    Day,
    Measurement,
    Note,
    OdometryRow,
)
from iveg.models.people import DetectionRow
from iveg.models.typescript import PAGE_MODELS

SHOWN: Final[tuple[type[Model], ...]] = (
    *PAGE_MODELS,
    AcknowledgedAlerts,
    Day,
    DetectionRow,
    OdometryRow,
    Measurement,
    Recording,
    Note,
)
_HEAD: Final = """\
# Resources

This page is generated: `python -m iveg.models.docs > docs/interfaces/resources.md`.

Each resource has one shape, on `/live`, in REST, lists, history and exports alike.
Members of an open command or present detection alone are null, empty or false in the
history. `/openapi.json` is made of the same models.

**Types** are those of JSON. An object of numbers has numbers as values, under keys that
its row names; a scalar is a string, number, boolean or null.

**Units** stand in brackets. Moments are ISO-8601 in UTC.

**Lists** are `{"items": [resource, …], "next": cursor or null}`.

**Sentences** are a `key`, which names a template in `iveg/static/i18n/{es,en}.json`,
and `slots`, an object whose values fill the template's `{named}` holes. Numbers are
formatted by the reader's locale.
"""
_FEW: Final = 3
"""A value of more kinds than that may be any scalar."""


def write_page() -> str:
    """The whole page."""
    _, document = models_json_schema([(model, "serialization") for model in SHOWN])
    shapes = document["$defs"]
    sections = (
        _section(name, schema, shapes)
        for name, schema in sorted(shapes.items())
        if "properties" in schema
    )
    return "\n".join([_HEAD, *sections])


def _section(name: str, schema: Json, shapes: Json) -> str:
    text = "\n\n".join(in_line(part) for part in schema["description"].split("\n\n"))
    rows = [
        f"| {', '.join(names)} | {kind} | {meaning} |\n"
        for names, kind, meaning in _rows(schema, shapes)
    ]
    head = "| key | type | meaning |\n|---|---|---|\n"
    return f"## {name}\n\n{text}\n\n{head}{''.join(rows)}"


def _rows(schema: Json, shapes: Json) -> Iterator[tuple[list[str], str, str]]:
    """Rows of the table; neighbours of one type and meaning share a row."""
    members = [
        (f"`{key}`", type_of(member, shapes), member.get("description", ""))
        for key, member in schema["properties"].items()
    ]
    for (kind, meaning), rows in groupby(members, lambda row: row[1:]):
        keys = [row[0] for row in rows]
        # Without a meaning nothing says that neighbours mean the same.
        for names in [keys] if meaning else [[key] for key in keys]:
            yield names, kind, meaning or "–"


def type_of(schema: Json, shapes: Json) -> str:
    """A JSON schema in words."""
    match schema:
        case {"$ref": str(ref)}:
            name = ref.rpartition("/")[2]
            is_shape = "properties" in shapes[name]
            return f"[{name}](#{name.lower()})" if is_shape else _named(shapes[name])
        case {"anyOf": [*kinds]} if len(kinds) > _FEW:
            return "scalar"
        case {"anyOf": [*kinds]}:
            return " or ".join(type_of(kind, shapes) for kind in kinds)
        case {"prefixItems": [*kinds]}:
            return f"[{', '.join(type_of(kind, shapes) for kind in kinds)}]"
        case {"items": kind}:
            return f"array of {type_of(kind, shapes)}"
        case {"additionalProperties": dict(kind)}:
            return f"object of {type_of(kind, shapes)}"
    return _named(schema)


def _named(schema: Json) -> str:
    if "enum" in schema:
        return " or ".join(f"`{value}`" for value in schema["enum"])
    return str(schema.get("type", "any JSON"))


if __name__ == "__main__":
    sys.stdout.write(write_page())
