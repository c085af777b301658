"""Files of the page that Python writes: ``python -m iveg.models.typescript``.

The output, the types of the models (``static/js/types.d.ts``), the small sensors and
the order of situations (``static/js/core``), is checked in; a test fails when it is
stale, so that a field has one name, one type and one meaning on both sides.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from importlib.resources import files
from pathlib import Path

from pydantic.json_schema import models_json_schema

from iveg.domain.kinds import SENSED, Kind, Sensor
from iveg.domain.quantities import flags_of
from iveg.domain.records import Json
from iveg.domain.situation import ORDER
from iveg.models.access import Invitation, NewToken, OpenSession, OwnAccount, SignInCode
from iveg.models.base import Costmap, Coverage, Model, Scan
from iveg.models.command import FleetPressed
from iveg.models.health import LatencyTable
from iveg.models.history import AuditEntry, Decision, Reading
from iveg.models.people import Thing
from iveg.models.rule import Trial
from iveg.models.snapshot import PastWorld, Snapshot

PAGE_MODELS: tuple[type[Model], ...] = (
    Snapshot,
    PastWorld,
    Scan,
    Costmap,
    Coverage,
    Decision,
    LatencyTable,
    FleetPressed,
    AuditEntry,
    Reading,
    SignInCode,
    Invitation,
    NewToken,
    OpenSession,
    OwnAccount,
    Thing,
    Trial,
)
"""Models that a page reads; the models of their members come with them."""
_PLAIN = {
    "string": "string",
    "integer": "number",
    "number": "number",
    "boolean": "boolean",
    "null": "null",
}
_HEAD = """\
/**
 * Written by `python -m iveg.models.typescript`; change the models, not this file.
 * Lengths in metres, angles in radians, ages in seconds, times ISO-8601 UTC.
 */
"""
_SENSORS_HEAD = """\
/**
 * The small sensors of robots; written by `python -m iveg.models.typescript` from
 * `iveg/domain/kinds.py`.  `shown` is the quantity on the card, a true flag words it.
 */

export const SENSORS = /** @type {const} */ ([
"""
_ORDER_HEAD = """\
/**
 * What can hold for a robot, in the order in which it is told, and how grave it is;
 * written by `python -m iveg.models.typescript` from `iveg/domain/situation.py`.
 */

"""
_Schema = Json


def write_types() -> str:
    """The whole file."""
    _, document = models_json_schema(
        [(model, "serialization") for model in PAGE_MODELS]
    )
    schemas = sorted(document["$defs"].items())
    return _HEAD + "".join(_declared(name, schema) for name, schema in schemas)


def _declared(name: str, schema: _Schema) -> str:
    if "properties" not in schema:
        return f"\nexport type {name} = {_type(schema)};\n"
    lines = "\n".join(_members(schema))
    return f"\n{_comment(schema, '')}export type {name} = {{\n{lines}\n}};\n"


def _members(schema: _Schema) -> Iterator[str]:
    for name, member in schema["properties"].items():
        yield f"{_comment(member, '  ')}  {name}: {_type(member)};"


def _comment(schema: _Schema, indent: str) -> str:
    # The first paragraph alone; the whole text is in docs/interfaces/resources.md.
    text = schema.get("description", "").split("\n\n")[0].replace("\n", " ")
    return f"{indent}/** {text} */\n" if text else ""


def _type(schema: _Schema) -> str:
    if "$ref" in schema:
        return str(schema["$ref"].rpartition("/")[2])
    if "enum" in schema or "const" in schema:
        values = schema.get("enum", [schema.get("const")])
        return " | ".join(f'"{value}"' for value in values)
    if "anyOf" in schema:
        # Two Python types, as int and float, may be one of TypeScript: written once.
        return " | ".join(dict.fromkeys(_type(kind) for kind in schema["anyOf"]))
    if schema.get("type") == "array":
        return _list(schema)
    if schema.get("type") == "object":
        inner = schema.get("additionalProperties")
        return (
            f"Record<string, {_type(inner) if isinstance(inner, dict) else 'unknown'}>"
        )
    return _PLAIN.get(schema.get("type", ""), "unknown")


def _list(schema: _Schema) -> str:
    if "prefixItems" in schema:
        return f"[{', '.join(_type(kind) for kind in schema['prefixItems'])}]"
    inner = _type(schema["items"])
    # In TypeScript ``A | B[]`` would make a list of B alone.
    return f"({inner})[]" if " | " in inner else f"{inner}[]"


def write_sensors() -> str:
    """The small sensors, as cards show them."""
    rows = [_shown(kind, kind.sensor) for kind in SENSED if kind.sensor]
    return f"{_SENSORS_HEAD}{''.join(map(_row, rows))}]);\n"


def _row(members: Mapping[str, object]) -> str:
    lines = "".join(
        f"    {name}: {json.dumps(value)},\n" for name, value in members.items()
    )
    return f"  {{\n{lines}  }},\n"


def _shown(kind: Kind, sensor: Sensor) -> dict[str, object]:
    return {"name": kind.name, "shown": sensor.shown, "flags": flags_of(kind.type_)}


def write_order() -> str:
    """The order in which situations are shown."""
    rows = "".join(f'  {kind}: "{level}",\n' for kind, level in ORDER.items())
    return f"{_ORDER_HEAD}export const ORDER = /** @type {{const}} */ ({{\n{rows}}});\n"


WRITTEN: Mapping[str, Callable[[], str]] = {
    "types.d.ts": write_types,
    "core/order.js": write_order,
    "core/sensors.js": write_sensors,
}
"""Files below ``static/js``."""

if __name__ == "__main__":
    for name, write in WRITTEN.items():
        Path(str(files("iveg") / "static/js" / name)).write_text(write())
