"""What the history holds as JSON; null where a row holds none that is whole."""

import orjson
from pydantic import JsonValue

from iveg.models.base import Slots, stamp


def read_json(text: str | None) -> JsonValue:
    """Our own JSON text back as a value."""
    try:
        value: JsonValue = orjson.loads(text or "null")
    except orjson.JSONDecodeError:
        return None
    return value


def read_objects(text: str) -> list[dict[str, JsonValue]]:
    """A list of objects; empty where there is none."""
    found = read_json(text)
    items = found if isinstance(found, list) else []
    return [one for one in items if isinstance(one, dict)]


def read_slots(text: str) -> Slots:
    """What fills the holes of a sentence."""
    found = read_json(text)
    items = found.items() if isinstance(found, dict) else ()
    return {
        name: value
        for name, value in items
        if value is None or isinstance(value, str | bool | int | float)
    }


def read_stamp(at: JsonValue) -> str | None:
    """A moment that is kept as Unix seconds."""
    return stamp(at) if isinstance(at, int | float) else None
