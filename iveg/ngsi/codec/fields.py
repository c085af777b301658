"""Fields that several messages share: who said it and when, holds, round numbers.

Parsing of untrusted JSON, and the parts that could not be read.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import orjson
from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import (
    EntityReading,
    FeedbackRef,
    Hold,
    LaserScan,
    Observation,
    Origin,
)
from iveg.domain.stamps import parse_stamp
from iveg.ngsi import names, payloads

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
    return payloads.clean_text(f"{place}: {complaint['msg']}")


def read_origin(value: payloads.OriginFields) -> Origin:
    """Read boot, sequence number, time, and the newest feedback of the sender."""
    stamp_s = None if value.stamp is None else parse_stamp(value.stamp)
    heard = value.heard
    return Origin(
        value.boot,
        value.seq,
        value.stamp,
        stamp_s,
        value.mono,
        # A robot without feedback yet sends ``null``.
        acknowledgements="heard" in value.model_fields_set,
        heard=None if heard is None else FeedbackRef(heard.boot, heard.seq),
        heard_also=tuple(FeedbackRef(one.boot, one.seq) for one in value.heard_also),
        replay=value.replay,
    )


_PROOF = ("mono", "heard", "heard_also", "replay")


def read_stamped(attributes: Mapping[str, object]) -> Origin:
    """The message's own stamp, and what proves its age, which stands at the pose."""
    pose = attributes.get("pose")
    if not isinstance(pose, dict):
        pose = {}
    fields = {key: pose[key] for key in _PROOF if key in pose}
    fields["stamp"] = attributes.get("timestamp")
    return read_origin(payloads.OriginFields.model_validate(fields))


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


def _write_ref(heard: FeedbackRef | None) -> dict[str, object] | None:
    return None if heard is None else {"boot": heard.boot, "seq": heard.seq}


def read_holds(values: Iterable[payloads.HoldValue]) -> tuple[Hold, ...]:
    """Why a robot may not move."""
    return tuple(Hold(value.id, value.source, value.ack) for value in values)


def write_hold(hold: Hold) -> dict[str, str]:
    """One hold of a robot's report."""
    return {"id": hold.id, "source": hold.source, "ack": hold.ack}


def write_motion(pose: Pose2D, twist: Twist2D) -> dict[str, object]:
    """Pose and twist of an odometry."""
    return {
        "x": round(pose.x, 4),
        "y": round(pose.y, 4),
        "yaw": round(pose.yaw, 5),
        "linear_velocity": round(twist.linear_x, 4),
        "angular_velocity": round(twist.angular_z, 4),
    }


def write_lidar_header(scan: LaserScan, origin: dict[str, object]) -> dict[str, object]:
    """``lidar_header``, with the origin of its message."""
    return {
        "angle_min": scan.angle_min,
        "angle_increment": scan.angle_increment,
        "range_min": scan.range_min,
        "range_max": scan.range_max,
        "x": scan.mount.x,
        "y": scan.mount.y,
        "yaw": scan.mount.yaw,
        **origin,
    }


def rounded(value: float | None) -> float | None:
    """To a tenth of a millimetre, or of a thousandth."""
    return None if value is None else round(value, 4)


def without_none(fields: dict[str, object]) -> dict[str, object]:
    """Only what is known: absent, never ``null``."""
    return {name: value for name, value in fields.items() if value is not None}
