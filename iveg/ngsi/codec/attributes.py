"""The attributes of an entity, one reader each."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from pydantic import TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Canary,
    Climate,
    CommandAnswer,
    CommandStatus,
    Detection,
    DetectionFrame,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.ngsi import names, payloads
from iveg.ngsi.codec.door import Reading, first_complaint, merge, unread
from iveg.ngsi.codec.fields import read_holds, read_origin

_BASE_LINK = Pose2D(0.0, 0.0, 0.0)
_LIDAR_POINTS: TypeAdapter[list[float | None]] = TypeAdapter(payloads.LidarPoints)
_Reader = Callable[[str, Any], Observation]


def read_attributes(robot_id: str, attributes: Mapping[str, Any]) -> Reading:
    """Read every attribute of a robot that the contract knows; skip the others."""
    readings = []
    for name, reader in _READERS.items():
        if attributes.get(name) is not None:
            readings.append(read_one(robot_id, reader, attributes, name))
    return merge(readings)


def read_one(
    source: str, reader: _Reader, attributes: Mapping[str, Any], name: str = ""
) -> Reading:
    """What one reader makes of an entity, or why it cannot."""
    try:
        return Reading((reader(source, attributes),))
    except ValidationError as error:
        return unread(source, f"bad_{name or 'entity'}", first_complaint(error))
    except UnreadableError as error:
        return unread(source, error.reason, error.detail)


def _odometry(robot_id: str, attributes: Mapping[str, Any]) -> Odometry:
    return _odometry_of(
        robot_id, payloads.OdometryValue.model_validate(attributes[names.ODOMETRY])
    )


def _odometry_of(robot_id: str, value: payloads.OdometryValue) -> Odometry:
    return Odometry(
        robot_id,
        read_origin(value),
        Pose2D(value.x, value.y, value.yaw),
        Twist2D(value.linear_velocity, value.angular_velocity),
    )


def _scan(robot_id: str, attributes: Mapping[str, Any]) -> LaserScan:
    return _scan_of(robot_id, attributes[names.LIDAR], attributes.get("lidar_header"))


def _scan_of(robot_id: str, points: Any, raw_header: Any) -> LaserScan:
    ranges = np.array(_LIDAR_POINTS.validate_python(points), np.float32)
    ranges[np.isnan(ranges)] = np.inf
    if raw_header is None:
        return LaserScan(
            robot_id,
            Origin(),
            angle_min=-np.pi,
            angle_increment=2 * np.pi / max(1, ranges.size),
            range_min=0.0,
            range_max=1e4,
            mount=_BASE_LINK,
            ranges=ranges,
        )
    header = payloads.LidarHeaderValue.model_validate(raw_header)
    return LaserScan(
        robot_id,
        read_origin(header),
        header.angle_min,
        header.angle_increment,
        header.range_min,
        header.range_max,
        Pose2D(header.x, header.y, header.yaw),
        ranges,
    )


def _detections(robot_id: str, attributes: Mapping[str, Any]) -> DetectionFrame:
    boxes = attributes[names.BOXES]
    if isinstance(boxes, dict):
        boxes = [boxes]
    if not isinstance(boxes, list) or len(boxes) > payloads.MAX_BOXES:
        raise UnreadableError("bad_bounding_boxes", "neither a box nor a short list")
    origin = Origin()
    if attributes.get(names.BOXES_HEADER) is not None:
        origin = read_origin(
            payloads.OriginFields.model_validate(attributes[names.BOXES_HEADER])
        )
    read = [_detection(box) for box in boxes]
    found = tuple(detection for detection in read if detection is not None)
    return DetectionFrame(robot_id, origin, found, unreadable=len(read) - len(found))


def _detection(raw: Any) -> Detection | None:
    try:
        box = payloads.BoxValue.model_validate(raw)
    except ValidationError:
        return None
    position = Box3D(**box.position.model_dump())
    return Detection(box.class_id, box.probability, position, box.frame_id, box.det_id)


def _safety(robot_id: str, attributes: Mapping[str, Any]) -> SafetyReport:
    value = payloads.SafetyValue.model_validate(attributes[names.SAFETY])
    return SafetyReport(
        robot_id,
        read_origin(value),
        value.speed_factor,
        value.reason,
        value.cause,
        value.decision_id,
        read_holds(value.holds),
        tuple(value.released),
        value.ch,
        value.v,
        value.w,
        value.feedback_age_s,
    )


def _navigation(robot_id: str, attributes: Mapping[str, Any]) -> Navigation:
    value = payloads.NavigationValue.model_validate(attributes[names.NAVIGATION])
    return Navigation(
        robot_id,
        read_origin(value),
        value.task,
        None if value.goal is None else (value.goal.x, value.goal.y),
        tuple((point[0], point[1]) for point in value.path),
    )


def _command_status(robot_id: str, attributes: Mapping[str, Any]) -> CommandStatus:
    return CommandStatus(
        robot_id, payloads.clean_text(str(attributes[names.COMMAND_STATUS]))
    )


def _command_info(robot_id: str, attributes: Mapping[str, Any]) -> CommandAnswer:
    return command_answer(robot_id, {names.COMMAND: attributes[names.COMMAND_INFO]})


def command_answer(robot_id: str, attributes: Mapping[str, Any]) -> CommandAnswer:
    """A robot's own answer to a command (interfaces.md §3)."""
    value = payloads.AnswerValue.model_validate(attributes.get(names.COMMAND))
    return CommandAnswer(
        robot_id,
        read_origin(value),
        value.id,
        value.r,
        read_holds(value.holds),
        value.ch,
        value.v,
        value.why,
        value.attempt,
    )


def _single_pose(robot_id: str, attributes: Mapping[str, Any]) -> Odometry:
    value = payloads.OdometryValue.model_validate(attributes["pose"])
    odometry = _odometry_of(robot_id, value)
    if odometry.origin.stamp is None:
        origin = _stamped(attributes)
        return Odometry(robot_id, origin, odometry.pose, odometry.twist)
    return odometry


def _single_scan(robot_id: str, attributes: Mapping[str, Any]) -> LaserScan:
    return _scan_of(robot_id, attributes["laser_scan"], attributes.get("lidar_header"))


_POINT_HALF_SIZE = 0.25
"""Algorithm 1 sends a point; it is drawn as a box of half a metre."""


def _single_detection(robot_id: str, attributes: Mapping[str, Any]) -> DetectionFrame:
    point = payloads.PointValue.model_validate(attributes.get("position_3D"))
    size = _POINT_HALF_SIZE
    box = {
        "class_id": attributes["class"],
        "probability": attributes.get("conf"),
        "frame_id": "map",
        "position": {
            "xmin": point.x - size,
            "xmax": point.x + size,
            "ymin": point.y - size,
            "ymax": point.y + size,
            "zmin": point.z - size,
            "zmax": point.z + size,
        },
    }
    detection = _detection(box)
    found = () if detection is None else (detection,)
    return DetectionFrame(robot_id, _stamped(attributes), found, 1 - len(found))


_PROOF = ("mono", "heard")


def _stamped(attributes: Mapping[str, Any]) -> Origin:
    """The message's own stamp, and what proves its age, which stands at the pose."""
    pose = attributes.get("pose")
    if not isinstance(pose, dict):
        pose = {}
    fields = {key: pose[key] for key in _PROOF if key in pose}
    fields["stamp"] = attributes.get("timestamp")
    return read_origin(payloads.OriginFields.model_validate(fields))


_READERS: Mapping[str, _Reader] = {
    names.ODOMETRY: _odometry,
    names.LIDAR: _scan,
    names.BOXES: _detections,
    names.SAFETY: _safety,
    names.NAVIGATION: _navigation,
    names.COMMAND_STATUS: _command_status,
    names.COMMAND_INFO: _command_info,
    "pose": _single_pose,
    "laser_scan": _single_scan,
    "class": _single_detection,
}


def climate(_: str, attributes: Mapping[str, Any]) -> Climate:
    """What the house measures."""
    value = payloads.ClimateValue.model_validate(dict(attributes))
    return Climate(value.temperature, value.relativeHumidity, value.co2)


def canary(_: str, attributes: Mapping[str, Any]) -> Canary:
    """The probe that iVeg sends through the whole chain."""
    return Canary(
        read_origin(payloads.OriginFields.model_validate(attributes["probe"]))
    )
