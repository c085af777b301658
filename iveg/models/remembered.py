"""Conversion of the history's JSON to models."""

from pydantic import JsonValue

from iveg.domain.records import Json
from iveg.models.base import Slots, stamp


def read_slots(found: Json) -> Slots:
    """Values of a sentence's placeholders."""
    return {
        name: value
        for name, value in found.items()
        if value is None or isinstance(value, str | bool | int | float)
    }


def read_stamp(at: JsonValue) -> str | None:
    """A moment that is kept as Unix seconds."""
    return stamp(at) if isinstance(at, int | float) else None
