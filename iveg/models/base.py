"""Base of all models: frozen, only declared fields, encoded by orjson."""

from typing import Generic, TypeVar

import orjson
from pydantic import BaseModel, ConfigDict

from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp

Slots = dict[str, str | bool | int | float | None]
"""Values of the ``{named}`` placeholders of a sentence."""


class Model(BaseModel):
    """Base of all resources; lengths in metres, angles in radians, ages in seconds."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        serialize_by_alias=True,
        validate_by_alias=True,
        validate_by_name=True,
    )


class Body(BaseModel):
    """Base of what a request brings: each value of its own kind, and nothing else."""

    model_config = ConfigDict(strict=True, extra="forbid")


M = TypeVar("M", bound=Model)


class Listing(Model, Generic[M]):
    """One page of a list; ``next`` is the cursor of the page after it."""

    items: list[M]
    next: str | None = None


def write_json(value: object) -> bytes:
    """Models, and whatever holds them, as JSON."""
    return orjson.dumps(value, default=_plain)


def _plain(value: object) -> object:
    if isinstance(value, Model):
        return orjson.Fragment(value.model_dump_json())
    raise TypeError(type(value).__name__)


def moment(at: Instant | None) -> str | None:
    """An instant as ISO-8601 UTC with milliseconds."""
    return None if at is None else format_stamp(at.wall)


def stamp(wall: float | None) -> str | None:
    """Unix seconds as ISO-8601 UTC with milliseconds."""
    return None if wall is None else format_stamp(wall)


def rounded(value: float | None, digits: int = 3) -> float | None:
    """A number with no more decimals than it can mean."""
    return None if value is None else round(value, digits)
