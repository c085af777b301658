"""Writer of robots' messages; the inverse of the readers."""

from typing import Any

import orjson
from pydantic import TypeAdapter

from iveg.domain.geometry import Twist2D
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
