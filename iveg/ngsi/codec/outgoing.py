"""Writer of robots' messages and of orders to robots; the inverse of the readers."""

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import orjson
from pydantic import TypeAdapter

from iveg.domain.geometry import Twist2D
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.kinds import kind
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    Detection,
    DetectionFrame,
    GoalAnswer,
    LaserScan,
    Observation,
    Origin,
    Unplaced,
)
from iveg.ngsi import names
from iveg.ngsi.codec.fields import adapter, write_message, write_origin

_BOX = TypeAdapter(Detection)

# --- measures ---------------------------------------------------------------------


def write_measure(value: Observation) -> bytes:
    """Payload of ``/{apikey}/{robot}_{device}/attrs`` for an observation."""
    match value:
        case LaserScan():
            attributes = _write_scan(value)
        case DetectionFrame():
            attributes = _write_frame(value)
        case Unplaced():
            attributes = _write_unplaced(value)
        case _:
            ((name, _),) = kind(value).attributes
            attributes = {name: write_message(value) | write_origin(value.origin)}
    return _dump(value.origin, attributes)


def _dump(origin: Origin, attributes: dict[str, Any]) -> bytes:
    if origin.stamp is not None:
        attributes["TimeInstant"] = origin.stamp
    return orjson.dumps(attributes, option=orjson.OPT_SERIALIZE_NUMPY)


def _write_scan(value: LaserScan) -> dict[str, Any]:
    """Attributes of a scan; a beam without a return is ``null``."""
    header = write_message(value)
    ranges = header.pop("ranges")
    return {
        names.LIDAR: ranges,
        names.LIDAR_HEADER: header | write_origin(value.origin),
    }


def _write_frame(value: DetectionFrame) -> dict[str, Any]:
    boxes: list[dict[str, Any]] = [
        _BOX.dump_python(detection, by_alias=True, exclude_none=True)
        for detection in value.detections
    ]
    header = write_origin(value.origin)
    if value.detector is not None:
        header["detector"] = value.detector
    # Somebody is at an unknown place: that must not look like an empty frame.
    nowhere = {"frame_id": names.UNPLACED}
    boxes += [
        nowhere if class_id is None else {"class_id": class_id, **nowhere}
        for class_id in value.unread
    ]
    return {names.BOXES: boxes, names.BOXES_HEADER: header}


def _write_unplaced(value: Unplaced) -> dict[str, Any]:
    """Attributes of odometry or a scan without a pose.

    A reader that does not know ``unplaced`` refuses the whole for want of x, y and yaw,
    so that nobody can draw it at a wrong place.
    """
    nowhere = dict.fromkeys(("x", "y", "yaw")) | write_origin(value.origin)
    nowhere["frame_id"] = names.UNPLACED
    if value.kind == "scan":
        return {names.LIDAR: [], names.LIDAR_HEADER: nowhere}
    if value.twist is not None:
        nowhere |= adapter(Twist2D).dump_python(value.twist, by_alias=True)
    return {names.ODOMETRY: nowhere}


# --- answers, climate, probe ------------------------------------------------------

_IDENTITY = frozenset({"boot", "seq", "replay"})


def write_answer(value: CommandAnswer | GoalAnswer) -> bytes:
    """Payload of ``/{apikey}/{robot}/cmdexe``, for a command or a goal."""
    origin = write_origin(value.origin)
    name = names.GOAL
    if isinstance(value, CommandAnswer):
        # Without proof of its age: a person who pressed STOP waits for this answer.
        origin = {key: origin[key] for key in _IDENTITY & origin.keys()}
        name = names.COMMAND
    return orjson.dumps({name: write_message(value) | origin})


def write_climate(value: Climate, stamp: str) -> bytes:
    """Payload of ``/{apikey}/climate/attrs``."""
    return orjson.dumps(write_message(value) | {"TimeInstant": stamp})


def write_heartbeat(origin: Origin) -> bytes:
    """Payload of ``/{apikey}/iveg-canary/attrs``."""
    return _dump(origin, {"probe": write_origin(origin)})


# --- orders -----------------------------------------------------------------------


def write_stop(hold_id: str, by: str) -> dict[str, object]:
    """Value of ``cmd`` that stops a robot."""
    return {"stop": {"id": hold_id, "by": by}}


def write_release(
    hold_ids: Iterable[str], challenge: str, attempt: str
) -> dict[str, object]:
    """Value of ``cmd`` that lifts exactly these holds.

    Args:
        hold_ids: Every remote hold of the robot.
        challenge: The robot's newest challenge.
        attempt: Id of this order, by which the robot recognises its copies.
    """
    return {"release": {"ids": list(hold_ids), "ch": challenge, "attempt": attempt}}


def write_resume(challenge: str, attempt: str) -> dict[str, object]:
    """Value of ``cmd`` that lets a released robot drive; as ``write_release``."""
    return {"resume": {"ch": challenge, "attempt": attempt}}


def write_goal(order: GoalOrder | CancelOrder) -> dict[str, object]:
    """Value of ``goal`` that sets or cancels a goal."""
    if isinstance(order, CancelOrder):
        return {"cancel": {"id": order.goal_id}}
    goal = order.goal
    fields = {"id": goal.goal_id, "kind": goal.kind, "x": goal.x, "y": goal.y}
    return {"set": {**fields, "ch": order.challenge, "until": order.until_s}}


def write_command(value: Mapping[str, object], name: str = names.COMMAND) -> bytes:
    """Payload of a command, as the IoT Agent publishes it on the robot's topic."""
    return orjson.dumps({name: value})


def write_desired(desired: Literal["stopped", "run"], ids: Iterable[str]) -> bytes:
    """Payload of the retained desired state on ``/{robot}/iveg/desired``."""
    return orjson.dumps({"desired": desired, "ids": list(ids)})
