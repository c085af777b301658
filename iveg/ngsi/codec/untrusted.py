"""Parsing of untrusted JSON, and the parts that could not be read."""

from collections.abc import Iterable
from dataclasses import dataclass

import orjson
from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import EntityReading, Observation
from iveg.ngsi import texts

MAX_DEPTH = 32
_CONTAINERS = frozenset({dict, list})


@dataclass(frozen=True, slots=True)
class UnreadPart:
    """Something that could not be read.

    Attributes:
        source: Robot, device or subscription that it came from.
        reason: A short, stable code to count by.
        detail: For the one log line.
    """

    source: str
    reason: str
    detail: str = ""


@dataclass(frozen=True, slots=True)
class ReadResult:
    """Content of a message: observations, and the parts that could not be read.

    Attributes:
        equipment: What it says of entities that are no robots, still unread.
    """

    observations: tuple[Observation, ...] = ()
    problems: tuple[UnreadPart, ...] = ()
    equipment: tuple[EntityReading, ...] = ()


def load_json(body: bytes | str) -> object:
    """Parse JSON that may be hostile.

    Raises:
        UnreadableError: not JSON (NaN and Infinity are not), or deeper than 32.
    """
    try:
        value = orjson.loads(body)
    except orjson.JSONDecodeError as error:
        raise UnreadableError("not_json", str(error)) from error
    if _brackets(body) > MAX_DEPTH and _deeper_than(value, MAX_DEPTH):
        raise UnreadableError("too_deep", f"more than {MAX_DEPTH} levels")
    return value


def _brackets(body: bytes | str) -> int:
    """Upper bound of the nesting: the number of brackets."""
    text = body.encode() if isinstance(body, str) else body
    return text.count(b"[") + text.count(b"{")


def _deeper_than(value: object, limit: int) -> bool:
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list):
        return False
    if limit == 0:
        return True
    # A scan's numbers are passed over as one, not looked at each.
    if _CONTAINERS.isdisjoint(map(type, value)):
        return False
    return any(_deeper_than(part, limit - 1) for part in value)


def unread(source: str, reason: str, detail: str = "") -> ReadResult:
    """A reading that is one problem."""
    return ReadResult(problems=(UnreadPart(source, reason, detail),))


def merge(readings: Iterable[ReadResult]) -> ReadResult:
    """Several readings as one, in order."""
    observations: list[Observation] = []
    problems: list[UnreadPart] = []
    equipment: list[EntityReading] = []
    for reading in readings:
        observations.extend(reading.observations)
        problems.extend(reading.problems)
        equipment.extend(reading.equipment)
    return ReadResult(tuple(observations), tuple(problems), tuple(equipment))


def first_complaint(error: ValidationError) -> str:
    """The first complaint of pydantic, without echoing the input."""
    complaint = error.errors(include_input=False, include_url=False)[0]
    place = ".".join(str(part) for part in complaint["loc"])
    return texts.clean_text(f"{place}: {complaint['msg']}")
