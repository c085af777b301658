"""Messages as JSON: parsing of hostile input, and reading and writing by type.

An unreadable part becomes an ``UnreadPart`` beside the readable ones.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, TypeVar, get_type_hints

import orjson
from pydantic import TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.kinds import KINDS
from iveg.domain.observations import (
    EntityReading,
    FeedbackRef,
    Observation,
    Origin,
)
from iveg.domain.stamps import parse_stamp
from iveg.domain.wire import IN_MESSAGE, clean_text
from iveg.ngsi import names

MAX_DEPTH = 32
_CONTAINERS = frozenset({dict, list})

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class UnreadPart:
    """Part of a message that could not be read.

    Attributes:
        source: Robot, device or subscription that sent it.
        reason: Short, stable code for counters.
        detail: Text for the log.
    """

    source: str
    reason: str
    detail: str = ""


@dataclass(frozen=True, slots=True)
class ReadResult:
    """Content of a message: observations, and the parts that could not be read.

    Attributes:
        equipment: Attributes of entities of other equipment, still unread.
    """

    observations: tuple[Observation, ...] = ()
    problems: tuple[UnreadPart, ...] = ()
    equipment: tuple[EntityReading, ...] = ()


# --- JSON -------------------------------------------------------------------------


def load_json(body: bytes | str) -> object:
    """Parse JSON that may be hostile.

    Raises:
        UnreadableError: not JSON (NaN and Infinity are not), or deeper than 32.
    """
    try:
        value = orjson.loads(body)
    except orjson.JSONDecodeError as error:
        raise UnreadableError("not_json", str(error)) from error
    text = body.encode() if isinstance(body, str) else body
    # Counting is fast: JSON is nested no deeper than it has brackets.
    brackets = text.count(b"[") + text.count(b"{")
    if brackets > MAX_DEPTH and _deeper_than(value, MAX_DEPTH):
        raise UnreadableError("too_deep", f"more than {MAX_DEPTH} levels")
    return value


def _deeper_than(value: object, limit: int) -> bool:
    if isinstance(value, dict):
        value = value.values()
    elif not isinstance(value, list):
        return False
    if limit == 0:
        return True
    # A scan's numbers are checked in one step, not one by one.
    if _CONTAINERS.isdisjoint(map(type, value)):
        return False
    return any(_deeper_than(part, limit - 1) for part in value)


def unread(source: str, reason: str, detail: str = "") -> ReadResult:
    """Result with a single problem."""
    return ReadResult(problems=(UnreadPart(source, reason, detail),))


def merge(readings: Sequence[ReadResult]) -> ReadResult:
    """Join several results, in order."""
    if len(readings) == 1:
        return readings[0]
    return ReadResult(
        tuple(chain.from_iterable(reading.observations for reading in readings)),
        tuple(chain.from_iterable(reading.problems for reading in readings)),
        tuple(chain.from_iterable(reading.equipment for reading in readings)),
    )


def first_complaint(error: ValidationError) -> str:
    """First complaint of pydantic, without the input."""
    complaint = error.errors(include_input=False, include_url=False)[0]
    place = ".".join(str(part) for part in complaint["loc"])
    return clean_text(f"{place}: {complaint['msg']}")


# --- messages ---------------------------------------------------------------------


_ADAPTERS: dict[type, TypeAdapter[Any]] = {}
_SPREAD: dict[type, tuple[str, ...]] = {}


def adapter(message: type[T]) -> TypeAdapter[T]:
    """Reader and writer of a declared message, built once."""
    if message not in _ADAPTERS:
        _ADAPTERS[message] = TypeAdapter(message)
        _SPREAD[message] = tuple(
            name
            for name, hint in get_type_hints(message, include_extras=True).items()
            if IN_MESSAGE in getattr(hint, "__metadata__", ())
        )
    return _ADAPTERS[message]


for _kind in KINDS:
    # Built at the start, not while the first message waits.
    adapter(_kind.type_)

_OBJECT = TypeAdapter(dict[str, Any])
_ORIGIN = TypeAdapter(Origin)


def read_message(
    message: type[T], robot_id: object, value: object, **parts: object
) -> T:
    """Read a robot's message by its declaration.

    Args:
        message: Type of the message.
        robot_id: Sender, by its topic or entity.
        value: Object on the wire.
        parts: Members that have been read already.

    Raises:
        ValidationError: the value differs from the declaration.
    """
    reader, members = adapter(message), _OBJECT.validate_python(value)
    members |= {"robot_id": robot_id, "origin": _origin(members), **parts}
    for name in _SPREAD[message]:
        members[name] = value
    return reader.validate_python(members)


def write_message(message: Observation) -> dict[str, Any]:
    """Object of a message on the wire, without robot and origin."""
    members: dict[str, Any] = adapter(type(message)).dump_python(
        message, by_alias=True, exclude={"robot_id", "origin"}
    )
    for name in _SPREAD[type(message)]:
        members |= members.pop(name)
    return members


def read_origin(value: object) -> Origin:
    """Read boot, sequence number, stamp, and the newest feedback that it echoes."""
    return _origin(_OBJECT.validate_python(value))


def _origin(members: dict[str, Any]) -> Origin:
    stamp = members.get("stamp")
    seconds = parse_stamp(clean_text(stamp)) if isinstance(stamp, str) else None
    # A robot without feedback yet sends ``null``.
    derived = {"stamp_s": seconds, "acknowledgements": "heard" in members}
    return _ORIGIN.validate_python(members | derived)


_PROOF = ("mono", "heard", "heard_also", "replay")


def read_stamped(attributes: Mapping[str, object]) -> Origin:
    """Read Algorithm 1's stamp, and the proof of its age, which stands at the pose."""
    pose = attributes.get("pose")
    if not isinstance(pose, dict):
        pose = {}
    fields = {key: pose[key] for key in _PROOF if key in pose}
    return read_origin({**fields, "stamp": attributes.get("timestamp")})


def refuse_unplaced(value: object) -> None:
    """Refuse data without a pose: it is counted and never drawn."""
    if isinstance(value, dict) and value.get("frame_id") == names.UNPLACED:
        raise UnreadableError(names.UNPLACED, "the robot knows no place for it")


def write_origin(origin: Origin) -> dict[str, object]:
    """The inverse of :func:`read_origin`."""
    fields: dict[str, object] = {
        "boot": origin.boot,
        "seq": origin.seq,
        "stamp": origin.stamp,
    }
    if origin.mono is not None:
        fields["mono"] = round(origin.mono, 6)
    if origin.acknowledgements:
        first, *others = map(_write_ref, origin.echoes or (None,))
        fields["heard"] = first
        if others:
            fields["heard_also"] = others
    if origin.replay is not None:
        fields["replay"] = origin.replay
    return fields


def _write_ref(ref: FeedbackRef | None) -> dict[str, object] | None:
    return None if ref is None else {"boot": ref.boot, "seq": ref.seq}
