"""Orders to the safety machine, its effects, and its answers."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationError

from iveg.domain import wire
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Twist2D
from iveg.domain.observations import CommandAnswer, SafetyReport
from iveg.ngsi import names
from iveg.ngsi.codec import load_json
from iveg.robot.holds import HoldSet

# --- orders -----------------------------------------------------------------------
#
# Orders from a robot's ``cmd`` topic: tolerant towards STOP, strict elsewhere.
#
# Any payload that mentions a STOP is one; a release or resume must match the contract
# exactly, or it is refused with a reason (docs/safety.md).

_STOP = "stop"
_MAX_NAMED = 128
"""Most ids in one order; a report never has so many holds."""


@dataclass(frozen=True, slots=True)
class StopOrder:
    """Halt and hold; ``id`` None when the sender gave no usable id."""

    id: str | None = None


def _refuse_unusable(text: str) -> str:
    """Refuse an id that the answer to the order could not carry."""
    if _usable_id(text) is None:
        raise ValueError("not an id")
    return text


_Name = Annotated[str, Field(min_length=1)]


class ResumeOrder(wire.Wire, extra="forbid"):
    """Drive again after a release.

    Attributes:
        challenge: Text of the robot's newest report.
        attempt: Id of the order, shared by its copies.
    """

    challenge: _Name = Field(alias="ch")
    attempt: Annotated[str, AfterValidator(_refuse_unusable)]


class ReleaseOrder(ResumeOrder):
    """Lift exactly these holds."""

    ids: Annotated[
        tuple[_Name, ...], Field(strict=False, min_length=1, max_length=_MAX_NAMED)
    ]


_STRICT: dict[object, type[ReleaseOrder | ResumeOrder]] = {
    "release": ReleaseOrder,
    "resume": ResumeOrder,
}
"""Orders that must be perfect."""


@dataclass(frozen=True, slots=True)
class Unusable:
    """An order that cannot be used; ``why`` is a short, stable code."""

    why: str


Order = StopOrder | ReleaseOrder | ResumeOrder | Unusable


def read_order(payload: bytes) -> Order:
    """Read one message of ``/{apikey}/{robot}/cmd``; never raises."""
    try:
        message = load_json(payload)
    except UnreadableError:
        # A STOP that was cut off or damaged on its way must still halt the robot.
        return (
            StopOrder() if _STOP.encode() in payload.lower() else Unusable("unreadable")
        )
    # JSON drops the first of two equal keys, so the bytes are searched as well.
    if b'"stop"' in payload.lower() or _mentions_stop(message):
        return StopOrder(_stop_id(message))
    return _release_or_resume(message)


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
    if not isinstance(value, str) or not value or wire.FORBIDDEN & set(value):
        return None
    return value if wire.clean_text(value) == value else None


def _release_or_resume(message: object) -> Order:
    command = _member(message, names.COMMAND)
    # Of two orders in a message nobody could say which the sender means.
    if not isinstance(command, dict) or len(command) != 1:
        return Unusable("malformed")
    ((name, content),) = command.items()
    try:
        return _STRICT[name].model_validate(content)
    except (KeyError, ValidationError):
        return Unusable("malformed")


# --- effects ----------------------------------------------------------------------
#
# Effects that the safety machine requests, as frozen values in the order of execution.
#
# The zero command comes first, then the hold set on disk, then the answer, then the
# report.

AnswerCode = Literal["LATCHED", "RELEASED", "RESUMED", "REFUSED"]


@dataclass(frozen=True, slots=True)
class Drive:
    """Send this command to the drive at once."""

    twist: Twist2D


@dataclass(frozen=True, slots=True)
class Persist:
    """Store this hold set so that it survives a loss of power."""

    holds: HoldSet


@dataclass(frozen=True, slots=True)
class SendAnswer:
    """Answer a command on ``cmdexe``; the uplink fills in the origin."""

    answer: CommandAnswer


@dataclass(frozen=True, slots=True)
class Report:
    """Publish a safety report; the uplink fills in the origin and returns its ``seq``.

    Attributes:
        is_measure: Also for the IoT Agent, which gets changes and two a second.
    """

    report: SafetyReport
    is_measure: bool = True


Effect = Drive | Persist | SendAnswer | Report


# --- verdicts ---------------------------------------------------------------------
#
# Answers of a robot to each attempt of a release or resume.
#
# Every copy of an order gets the answer of the first, even when the robot's state has
# changed: a refused order stays refused.

ATTEMPTS_KEPT = 64
"""Attempts whose answer is remembered; the challenge of a forgotten one is spent, so
that no copy of it can succeed."""

Verdict = tuple[str | None, AnswerCode, str | None]
"""Answer to a release or resume: the hold that it names, its code, and the reason of a
refusal."""
