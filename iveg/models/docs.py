"""The page of resources, from the models: ``python -m iveg.models.docs`` prints it.

The meaning of a key stands under "Attributes" in the docstring of its model, or in the
description of its field.
"""

import inspect
import re
import sys
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Final

from pydantic.json_schema import models_json_schema

from iveg.domain.records import Json
from iveg.models.base import Model
from iveg.models.health import Recording
from iveg.models.history import (
    AcknowledgedAlerts,
    Day,
    Measurement,
    Note,
    OdometryRow,
)
from iveg.models.people import DetectionRow
from iveg.models.typescript import TOLD

SHOWN: Final[tuple[type[Model], ...]] = (
    *TOLD,
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
What only a command or detection of this moment has is null, empty or false in the
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
_ROW: Final = re.compile(r"^    (\w+): (.*(?:\n {8}.*)*)", re.M)


def write_page() -> str:
    """The whole page."""
    _, document = models_json_schema([(one, "serialization") for one in SHOWN])
    shapes = document["$defs"]
    models = {one.__name__: one for one in _models(Model)}
    sections = (
        _section(models[name], schema, shapes)
        for name, schema in sorted(shapes.items())
        if "properties" in schema
    )
    return "\n".join([_HEAD, *sections])


def _models(base: type[Model]) -> Iterator[type[Model]]:
    for one in base.__subclasses__():
        yield one
        yield from _models(one)


def _section(model: type[Model], schema: Json, shapes: Json) -> str:
    text, _, _ = (inspect.getdoc(model) or "").partition("\n\nAttributes:")
    told = "\n\n".join(_line(one) for one in text.split("\n\n"))
    rows = [
        f"| {', '.join(names)} | {kind} | {meaning} |\n"
        for names, kind, meaning in _rows(model, schema, shapes)
    ]
    head = "| key | type | meaning |\n|---|---|---|\n"
    return f"## {model.__name__}\n\n{told}\n\n{head}{''.join(rows)}"


def _rows(
    model: type[Model], schema: Json, shapes: Json
) -> Iterator[tuple[list[str], str, str]]:
    """Keys that stand together and mean the same are one row."""
    meanings = _meanings(model)
    found = [
        (f"`{key}`", type_of(one, shapes), one.get("description") or meanings.get(key))
        for key, one in schema["properties"].items()
    ]
    for (kind, meaning), rows in groupby(found, lambda row: row[1:]):
        keys = [row[0] for row in rows]
        for names in [keys] if meaning else [[key] for key in keys]:
            yield names, kind, _line(meaning or "–")


def _meanings(model: type[Model]) -> Mapping[str, str]:
    """Meanings by key, as the docstrings of the model and its bases tell them."""
    told: dict[str, str] = {}
    for one in reversed(model.__mro__):
        _, _, rows = (inspect.cleandoc(one.__doc__ or "")).partition("Attributes:")
        told |= dict(_ROW.findall(rows))
    fields = model.model_fields.items()
    names = {key: one.serialization_alias or key for key, one in fields}
    return {names.get(key, key): text for key, text in told.items()}


def _line(text: str) -> str:
    return " ".join(text.replace("``", "`").split())


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
