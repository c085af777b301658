"""Messages as JSON: parsing of what may be hostile, and reading and writing by type.

What cannot be read becomes an ``UnreadPart`` beside what can.
"""

from collections.abc import Iterable, Mapping
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
    readings = tuple(readings)
    return ReadResult(
        tuple(chain.from_iterable(reading.observations for reading in readings)),
        tuple(chain.from_iterable(reading.problems for reading in readings)),
        tuple(chain.from_iterable(reading.equipment for reading in readings)),
    )


def first_complaint(error: ValidationError) -> str:
    """The first complaint of pydantic, without echoing the input."""
    complaint = error.errors(include_input=False, include_url=False)[0]
    place = ".".join(str(part) for part in complaint["loc"])
    return clean_text(f"{place}: {complaint['msg']}")


# --- messages ---------------------------------------------------------------------


_ADAPTERS: dict[type, TypeAdapter[Any]] = {}
_SPREAD: dict[type, tuple[str, ...]] = {}


def adapter(message: type[T]) -> TypeAdapter[T]:
    """Reader and writer of a declared message; the same one each time."""
    if message not in _ADAPTERS:
        _ADAPTERS[message] = TypeAdapter(message)
        hints = get_type_hints(message, include_extras=True).items()
        _SPREAD[message] = tuple(
            name
            for name, hint in hints
            if IN_MESSAGE in getattr(hint, "__metadata__", ())
        )
    return _ADAPTERS[message]


for _kind in KINDS:
    # Built at the start, not while the first message waits.
    adapter(_kind.of)

_OBJECT = TypeAdapter(dict[str, Any])
_ORIGIN = TypeAdapter(Origin)


def read_message(
    message: type[T], robot_id: object, value: object, **parts: object
) -> T:
    """Read a robot's message by its declaration.

    Args:
        message: Its type.
        robot_id: Who sent it.
        value: The object on the wire.
        parts: Members that are read already.

    Raises:
        ValidationError: it is not as declared.
    """
    reader, members = adapter(message), _OBJECT.validate_python(value)
    members |= {"robot_id": robot_id, "origin": _origin(members), **parts}
    for name in _SPREAD[message]:
        members[name] = value
    return reader.validate_python(members)


def write_message(message: Observation) -> dict[str, Any]:
    """The object on the wire, without robot and origin."""
    members: dict[str, Any] = adapter(type(message)).dump_python(
        message, by_alias=True, exclude={"robot_id", "origin"}
    )
    for name in _SPREAD[type(message)]:
        members |= members.pop(name)
    return members


def read_origin(value: object) -> Origin:
    """Read boot, sequence number, time, and the newest feedback of the sender."""
    return _origin(_OBJECT.validate_python(value))


def _origin(members: dict[str, Any]) -> Origin:
    stamp = members.get("stamp")
    seconds = parse_stamp(clean_text(stamp)) if isinstance(stamp, str) else None
    # A robot without feedback yet sends ``null``.
    derived = {"stamp_s": seconds, "acknowledgements": "heard" in members}
    return _ORIGIN.validate_python(members | derived)


_PROOF = ("mono", "heard", "heard_also", "replay")


def read_stamped(attributes: Mapping[str, object]) -> Origin:
    """The message's own stamp, and what proves its age, which stands at the pose."""
    pose = attributes.get("pose")
    if not isinstance(pose, dict):
        pose = {}
    fields = {key: pose[key] for key in _PROOF if key in pose}
    return read_origin({**fields, "stamp": attributes.get("timestamp")})


def refuse_unplaced(value: object) -> None:
    """Refuse data without a position: it is counted and never drawn."""
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
