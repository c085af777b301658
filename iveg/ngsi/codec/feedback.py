"""Messages of iVeg to robots, both ways: feedback, and scans of their peers."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, TypeVar

import numpy as np
import orjson
from pydantic import Field, TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import (
    CLEAR,
    LONGEST_BACKLOG_S,
    Feedback,
    FeedbackAlert,
    SpeedLimit,
)
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.parameters import CLASSES, SENT_PARAMETERS, Class, Parameter, Sent
from iveg.domain.peer_scan import BEAMS, PLACES, PeerScan
from iveg.domain.wire import MAX_ROBOTS, Text
from iveg.ngsi.codec.fields import (
    adapter,
    first_complaint,
    load_json,
    read_message,
    write_origin,
)

T = TypeVar("T")

# --- feedback ---------------------------------------------------------------------

_NAMES = TypeAdapter[list[str]](Annotated[list[Text], Field(max_length=MAX_ROBOTS)])
_ALERT = TypeAdapter(FeedbackAlert)
_ALERTS = TypeAdapter(tuple[FeedbackAlert, ...])
_LIMITS = TypeAdapter(dict[str, SpeedLimit])


def read_feedback(payload: bytes) -> Feedback:
    """Read ``/{robot}/mqtt_feedback``.

    Raises:
        UnreadableError: not a feedback; counts as no feedback (docs/safety.md).
    """
    value = load_json(payload)
    members = value if isinstance(value, dict) else {}
    pose = members.get("robot_pose")
    try:
        clear = dict.fromkeys(_NAMES.validate_python(members.get("clear", [])), CLEAR)
        feedback = read_message(
            Feedback,
            members.get("robot_id"),
            value,
            pose=pose,
            twist=pose,
            pose_stamp=pose.get("stamp") if isinstance(pose, dict) else None,
            backlog_s=_backlog(members.get("backlog")),
            rule=_rule(members.get("rule")),
        )
    except ValidationError as error:
        raise UnreadableError("not_feedback", first_complaint(error)) from error
    # A robot that is in both has its limit: the stricter reading counts.
    return replace(feedback, speed_limits=clear | {**feedback.speed_limits})


def _backlog(value: object) -> float | None:
    """Backlog (s); an unreadable one is None and does not cost the feedback."""
    seconds = value.get("fiware_s") if isinstance(value, dict) else None
    # A bool is an int in Python.
    if isinstance(seconds, bool) or not isinstance(seconds, int | float) or seconds < 0:
        return None
    return min(float(seconds), LONGEST_BACKLOG_S)


def _rule(value: object) -> Sent:
    """Values of the rule; unreadable ones are left out and do not cost the feedback."""
    values = value if isinstance(value, dict) else {}
    return {
        row.name: read
        for row in SENT_PARAMETERS
        if (read := _by_class(row, values.get(row.name)))
    }


def _by_class(row: Parameter, value: object) -> Mapping[Class, float]:
    values = value if isinstance(value, dict) else {}
    return {
        class_: float(number)
        for class_ in CLASSES
        if isinstance(number := values.get(class_), int | float)
        and not isinstance(number, bool)
        and row.least <= number <= row.most
    }


def write_feedback(feedback: Feedback) -> bytes:
    """Payload of ``/{robot}/mqtt_feedback``.

    For a robot without a limit only the id is written, or the fleet's limits would be
    most of the message.  A robot without any entry is unsupervised.
    """
    alert, backlog_s = feedback.alert, feedback.backlog_s
    limits = feedback.speed_limits
    limited = {name: limit for name, limit in limits.items() if limit != CLEAR}
    fields: dict[str, object] = {
        **write_origin(feedback.origin),
        "robot_id": feedback.robot_id,
        "alert": None if alert is None else _fragment(_ALERT, alert),
        "robot_pose": _write_pose(feedback),
        "alerts": _write_alerts(feedback.alerts),
        "speed_limits": _fragment(_LIMITS, limited),
        "clear": [name for name in limits if name not in limited],
        "seen": feedback.seen,
    }
    if backlog_s is not None:
        fields["backlog"] = {"fiware_s": round(min(backlog_s, LONGEST_BACKLOG_S), 1)}
    if feedback.foresight:
        fields["foresight"] = True
    if feedback.rule:
        fields["rule"] = feedback.rule
    return orjson.dumps(fields)


@lru_cache(maxsize=1)
def _write_alerts(alerts: tuple[FeedbackAlert, ...]) -> orjson.Fragment:
    """JSON of the alerts; cached, as all robots get the same."""
    return _fragment(_ALERTS, alerts)


def _fragment(writer: TypeAdapter[T], value: T) -> orjson.Fragment:
    """JSON by declaration; an unknown member is absent, never ``null``."""
    return orjson.Fragment(writer.dump_json(value, by_alias=True, exclude_none=True))


def _write_pose(feedback: Feedback) -> dict[str, object] | None:
    if feedback.pose is None:
        return None
    pose = adapter(Pose2D).dump_python(feedback.pose)
    twist = adapter(Twist2D).dump_python(feedback.twist or REST, by_alias=True)
    return {**pose, **twist, "stamp": feedback.pose_stamp}


# --- peers' scans -----------------------------------------------------------------

LARGEST = 1024
"""Largest peer scan (bytes)."""
_FULL = Field(min_length=BEAMS, max_length=BEAMS)
_Range = Annotated[float, Field(strict=True, ge=0, le=1e4)]
_RANGES = TypeAdapter[list[float | None]](Annotated[list[_Range | None], _FULL])
_PLACES = TypeAdapter[list[int]](
    Annotated[list[Annotated[int, Field(strict=True, ge=0, lt=PLACES)]], _FULL]
)


def write_peer_scan(scan: PeerScan) -> bytes:
    """Payload of ``/{robot}/iveg/peer_scan``."""
    # As float64: JSON of a float32 such as 0.1 would have 17 digits.
    ranges = scan.ranges.astype(np.float64).round(2).tolist()
    fields = adapter(PeerScan).dump_python(
        scan, by_alias=True, exclude={"origin", "ranges", "places"}
    )
    fields["robot_pose"]["frame_id"] = "map"
    identity = {
        "boot": scan.origin.boot,
        "seq": scan.origin.seq,
        "stamp": scan.origin.stamp,
        "ranges": [None if length == np.inf else length for length in ranges],
        "places": scan.places.tolist(),
    }
    return orjson.dumps(fields | identity)


def read_peer_scan(robot_id: str, payload: bytes) -> PeerScan:
    """Read ``/{robot}/iveg/peer_scan``.

    Raises:
        UnreadableError: ``too_large``, ``not_json``, ``not_a_peer_scan``, or
            ``another_robot`` than ``robot_id``.
    """
    if len(payload) > LARGEST:
        raise UnreadableError("too_large", f"{len(payload)} bytes")
    value = load_json(payload)
    members = value if isinstance(value, dict) else {}
    try:
        ranges = _RANGES.validate_python(members.get("ranges"))
        scan = read_message(
            PeerScan,
            members.get("robot_id"),
            value,
            ranges=np.array([np.inf if r is None else r for r in ranges], np.float32),
            places=np.array(_PLACES.validate_python(members.get("places")), np.uint8),
        )
    except ValidationError as error:
        raise UnreadableError("not_a_peer_scan", first_complaint(error)) from error
    if scan.robot_id != robot_id:
        raise UnreadableError("another_robot", scan.robot_id)
    if members["robot_pose"].get("frame_id") != "map":
        raise UnreadableError("not_a_peer_scan", "robot_pose is not in map")
    return scan
