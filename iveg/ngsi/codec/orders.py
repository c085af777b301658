"""Orders to robots, both ways; each is declared once.

The reader is tolerant towards STOP and strict elsewhere: any payload that mentions a
STOP is one; any other order must match the contract exactly (docs/safety.md).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import orjson
from pydantic import (
    AfterValidator,
    Field,
    Strict,
    TypeAdapter,
    ValidationError,
    with_config,
)

from iveg.domain.errors import UnreadableError
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.wire import FORBIDDEN, clean_text
from iveg.ngsi import names
from iveg.ngsi.codec.fields import load_json

_STOP = "stop"
_MAX_NAMED = 128
"""Most ids in one order; a report never has so many holds."""


@dataclass(frozen=True, slots=True)
class StopOrder:
    """Halt and hold.

    Attributes:
        id: None when the sender gave no usable id.
        by: Pseudonym of the sender; no robot reads it.
    """

    id: str | None = None
    by: str | None = None


def _refuse_unusable(text: str) -> str:
    """Refuse an id that the answer to the order could not carry."""
    if _usable_id(text) is None:
        raise ValueError("not an id")
    return text


_Name = Annotated[str, Strict(), Field(min_length=1)]


@with_config(extra="forbid")
@dataclass(frozen=True, slots=True)
class ResumeOrder:
    """Drive again after a release.

    Attributes:
        challenge: Text of the robot's newest report.
        attempt: Id of the order, shared by its copies.
    """

    challenge: Annotated[_Name, Field(alias="ch")]
    attempt: Annotated[str, Strict(), AfterValidator(_refuse_unusable)]


@with_config(extra="forbid")
@dataclass(frozen=True, slots=True)
class ReleaseOrder(ResumeOrder):
    """Lift exactly these holds."""

    ids: Annotated[tuple[_Name, ...], Field(min_length=1, max_length=_MAX_NAMED)]


@dataclass(frozen=True, slots=True)
class UnusableOrder:
    """An order that cannot be used; ``why`` is a short, stable code."""

    why: str


Order = StopOrder | ReleaseOrder | ResumeOrder | GoalOrder | CancelOrder
_COMMANDS = {_STOP: StopOrder, "release": ReleaseOrder, "resume": ResumeOrder}
_GOALS = {"set": GoalOrder, "cancel": CancelOrder}
_NAMES = {order: name for name, order in (_COMMANDS | _GOALS).items()}
_ADAPTERS: Mapping[type, TypeAdapter[Any]] = {
    order: TypeAdapter(order) for order in _NAMES
}

# --- writing ----------------------------------------------------------------------


def write_order(order: Order) -> tuple[str, dict[str, object]]:
    """Name of the command (``cmd`` or ``goal``) and its value."""
    declared = type(order)
    content = _ADAPTERS[declared].dump_python(order, mode="json", by_alias=True)
    name = names.GOAL if declared in _GOALS.values() else names.COMMAND
    return name, {_NAMES[declared]: content}


def write_command(order: Order) -> bytes:
    """Payload of an order, as the IoT Agent publishes it on the robot's topic."""
    return orjson.dumps(dict([write_order(order)]))


def write_desired(desired: Literal["stopped", "run"], ids: Iterable[str]) -> bytes:
    """Payload of the retained desired state on ``/{robot}/iveg/desired``."""
    return orjson.dumps({"desired": desired, "ids": list(ids)})


# --- reading ----------------------------------------------------------------------


def read_order(
    payload: bytes,
) -> StopOrder | ReleaseOrder | ResumeOrder | UnusableOrder:
    """Read one message of ``/{apikey}/{robot}/cmd``; never raises."""
    try:
        message = load_json(payload)
    except UnreadableError:
        # A STOP that was cut off or damaged on its way must still halt the robot.
        is_stop = _STOP.encode() in payload.lower()
        return StopOrder() if is_stop else UnusableOrder("unreadable")
    # JSON drops the first of two equal keys, so the bytes are searched as well.
    if b'"stop"' in payload.lower() or _mentions_stop(message):
        return StopOrder(_stop_id(message))
    return _read_exact(_member(message, names.COMMAND), _COMMANDS) or UnusableOrder(
        "malformed"
    )


def read_goal(payload: bytes) -> GoalOrder | CancelOrder | None:
    """Read a message of ``/{apikey}/{robot}/cmd`` that is about a goal.

    Returns:
        None for any other message, and for one that might be a STOP.
    """
    # A STOP goes to the safety machine, whatever else the message may mean.
    if b"stop" in payload.lower():
        return None
    try:
        message = load_json(payload)
    except UnreadableError:
        return None
    if not isinstance(message, dict) or message.keys() != {names.GOAL}:
        return None
    goal: GoalOrder | CancelOrder | None = _read_exact(message[names.GOAL], _GOALS)
    return goal


def _read_exact(value: object, declared: Mapping[Any, type]) -> Any:
    """The order that a value declares exactly; None where it differs anywhere."""
    # Of two orders in a message nobody could say which the sender means.
    if not isinstance(value, dict) or len(value) != 1:
        return None
    ((name, content),) = value.items()
    try:
        return _ADAPTERS[declared[name]].validate_python(content)
    except (KeyError, ValidationError):
        return None


def read_desired_state(payload: bytes) -> tuple[str, ...] | None:
    """Read ``/{robot}/iveg/desired``.

    Returns:
        Ids of the STOPs in force (empty: a STOP without an id); None: there is none.
    """
    try:
        level = load_json(payload)
    except UnreadableError:
        return () if _STOP.encode() in payload.lower() else None
    if not isinstance(level, dict) or level.get("desired") != "stopped":
        return None
    ids = level.get("ids")
    usable = [_usable_id(name) for name in ids] if isinstance(ids, list) else []
    return tuple(name for name in usable[:_MAX_NAMED] if name is not None)


def _mentions_stop(value: object) -> bool:
    if isinstance(value, str):
        return value.strip().casefold() == _STOP
    if isinstance(value, list):
        return any(_mentions_stop(part) for part in value)
    if isinstance(value, dict):
        return any(_mentions_stop(part) for pair in value.items() for part in pair)
    return False


def _stop_id(message: object) -> str | None:
    stop = _member(_member(message, names.COMMAND), _STOP)
    return _usable_id(_member(stop, "id"))


def _member(value: object, name: str) -> object:
    return value.get(name) if isinstance(value, dict) else None


def _usable_id(value: object) -> str | None:
    # Orion refuses these characters, so a report that names the hold would not arrive.
    if not isinstance(value, str) or not value or FORBIDDEN & set(value):
        return None
    return value if clean_text(value) == value else None
