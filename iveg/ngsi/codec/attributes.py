"""The attributes of an entity, one reader each."""

from array import array
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    CommandStatus,
    Detection,
    DetectionFrame,
    HeartbeatProbe,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Overtaken,
    RefusedFrame,
    RobotFault,
    SafetyReport,
)
from iveg.ngsi import names, payloads
from iveg.ngsi.codec.fields import read_holds, read_origin
from iveg.ngsi.codec.untrusted import ReadResult, first_complaint, merge, unread
from iveg.ngsi.sensors import SENSORS, Sensor

_BASE_LINK = Pose2D(0.0, 0.0, 0.0)
_LIDAR_POINTS: TypeAdapter[list[float | None]] = TypeAdapter(payloads.LidarPoints)
_BOXES: TypeAdapter[list[payloads.BoxValue]] = TypeAdapter(list[payloads.BoxValue])
Reader = Callable[[str, Any], Observation]
IsPast = Callable[[str, type[Observation], str, int], bool]
"""Whether robot, kind, boot and seq tell that a message cannot be news."""


def read_attributes(
    robot_id: str,
    attributes: Mapping[str, Any],
    is_past: IsPast | None = None,
    instead: Mapping[str, Reader] = MappingProxyType({}),
) -> ReadResult:
    """Read every attribute of a robot that the contract knows; skip the others.

    Args:
        robot_id: Whose they are.
        attributes: By name.
        is_past: Tells by its identity what need not be read; None reads all.
        instead: Other readers of some attributes.
    """
    readings = []
    known = attributes.keys() & _READERS.keys()
    # In the order of the table: where a robot is counts for what it sees there.
    for name in sorted(known, key=_RANK.__getitem__):
        if attributes[name] is None:
            continue
        old = (
            None if is_past is None else _overtaken(robot_id, name, attributes, is_past)
        )
        reader = instead.get(name) or _READERS[name]
        readings.append(old or read_one(robot_id, reader, attributes, name))
    return readings[0] if len(readings) == 1 else merge(readings)


def _overtaken(
    robot_id: str, name: str, attributes: Mapping[str, Any], is_past: IsPast
) -> ReadResult | None:
    """Remains of a message that is older than its stream; None where it may be new."""
    if name not in _IDENTITY:
        return None
    kind, holder = _IDENTITY[name]
    raw = attributes.get(holder)
    if type(raw) is not dict:
        return None
    boot, seq = raw.get("boot"), raw.get("seq")
    if type(boot) is not str or type(seq) is not int:
        return None
    if not is_past(robot_id, kind, payloads.clean_text(boot), seq):
        return None
    try:
        origin = read_origin(payloads.OriginFields.model_validate(raw))
    except ValidationError:
        return None
    return ReadResult((Overtaken(robot_id, origin, kind),))


def read_one(
    source: str, reader: Reader, attributes: Mapping[str, Any], name: str = ""
) -> ReadResult:
    """Result of one reader on an entity, or the reason of its failure."""
    try:
        return ReadResult((reader(source, attributes),))
    except ValidationError as error:
        read = unread(source, f"bad_{name or 'entity'}", first_complaint(error))
    except UnreadableError as error:
        read = unread(source, error.reason, error.detail)
    except Exception as error:
        # A value that no bound foresaw is that message's end and nobody else's.
        read = unread(source, f"bad_{name or 'entity'}", repr(error))
    return refused_frame(source, read) if name in _FRAMES else read


def refused_frame(robot_id: str, read: ReadResult) -> ReadResult:
    """A detection frame that cannot be read: a problem, and no empty picture."""
    return replace(read, observations=(RefusedFrame(robot_id),))


def _odometry(robot_id: str, attributes: Mapping[str, Any]) -> Odometry:
    _refuse_unplaced(attributes[names.ODOMETRY])
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


def _refuse_unplaced(value: Any) -> None:
    """Refuse data without a position: it is counted and never drawn."""
    if isinstance(value, dict) and value.get("frame_id") == names.UNPLACED:
        raise UnreadableError(names.UNPLACED, "the robot knows no place for it")


def _scan(robot_id: str, attributes: Mapping[str, Any]) -> LaserScan:
    _refuse_unplaced(attributes.get(names.LIDAR_HEADER))
    return _scan_of(robot_id, attributes[names.LIDAR], attributes.get("lidar_header"))


def _scan_of(robot_id: str, points: Any, raw_header: Any) -> LaserScan:
    ranges = _ranges(points)
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


def _ranges(points: Any) -> NDArray[np.float32]:
    """A scan's numbers as one buffer; inf where nothing came back.

    Raises:
        ValidationError: not a list of at most 4,096 numbers and nulls in range.
    """
    if type(points) is list and 0 < len(points) <= payloads.MAX_BEAMS:
        numbers = _plain_numbers(points)
        if numbers is not None:
            return numbers.astype(np.float32)
    ranges = np.array(_LIDAR_POINTS.validate_python(points), np.float32)
    ranges[np.isnan(ranges)] = np.inf
    return ranges


def _plain_numbers(points: list[Any]) -> NDArray[np.float64] | None:
    """The numbers, where there is nothing to judge: no null, no bool, all in range."""
    try:
        numbers = np.frombuffer(array("d", points))
    except (TypeError, OverflowError):
        return None
    # A bool looks like 0 or 1 here.  "Not" also refuses NaN, which no JSON has.
    if not (numbers.min() >= 0.0 and numbers.max() <= payloads.MAX_RANGE_M):
        return None
    return None if np.any(numbers == 0.0) or np.any(numbers == 1.0) else numbers


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
    try:
        read = list(map(_detection_of, _BOXES.validate_python(boxes)))
    except ValidationError:
        read = [_detection(box) for box in boxes]
    return _frame(robot_id, origin, boxes, read)


def _frame(
    robot_id: str, origin: Origin, boxes: list[Any], read: list[Detection | None]
) -> DetectionFrame:
    """What could be read of a frame, and the classes of the boxes that could not."""
    found = tuple(one for one in read if one is not None)
    if len(found) == len(boxes):
        return DetectionFrame(robot_id, origin, found)
    pairs = zip(boxes, read, strict=True)
    unread = tuple(_class_of(box) for box, detection in pairs if detection is None)
    return DetectionFrame(robot_id, origin, found, unread)


def _class_of(box: Any) -> str | None:
    class_id = box.get("class_id") if isinstance(box, dict) else None
    return payloads.clean_text(class_id) if isinstance(class_id, str) else None


def _detection(raw: Any) -> Detection | None:
    try:
        return _detection_of(payloads.BoxValue.model_validate(raw))
    except ValidationError:
        return None


def _detection_of(box: payloads.BoxValue) -> Detection | None:
    if box.frame_id == names.UNPLACED:
        return None
    sides = box.position
    position = Box3D(
        sides.xmin, sides.xmax, sides.ymin, sides.ymax, sides.zmin, sides.zmax
    )
    frame_id = box.frame_id or None
    return Detection(box.class_id, box.probability, position, frame_id, box.det_id)


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
        tuple(RobotFault(one.code, one.about, one.for_s) for one in value.faults),
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
    """A robot's own answer to a command (docs/interfaces/commands.md)."""
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


_HALF_M = 0.25
"""Algorithm 1 sends a point; it is drawn as a box of half a metre."""


def _single_detection(robot_id: str, attributes: Mapping[str, Any]) -> DetectionFrame:
    box = {
        "class_id": attributes["class"],
        "probability": attributes.get("conf"),
        "frame_id": "map",
        "position": _sides_about(attributes.get("position_3D")),
    }
    return _frame(robot_id, _stamped(attributes), [box], [_detection(box)])


def _sides_about(raw: Any) -> dict[str, float] | None:
    """Sides of the box about a point; None where it is none."""
    try:
        point = payloads.PointValue.model_validate(raw)
    except ValidationError:
        return None
    centre = {"x": point.x, "y": point.y, "z": point.z}
    return {
        axis + side: value + sign * _HALF_M
        for axis, value in centre.items()
        for side, sign in (("min", -1), ("max", 1))
    }


_PROOF = ("mono", "heard", "replay")


def _stamped(attributes: Mapping[str, Any]) -> Origin:
    """The message's own stamp, and what proves its age, which stands at the pose."""
    pose = attributes.get("pose")
    if not isinstance(pose, dict):
        pose = {}
    fields = {key: pose[key] for key in _PROOF if key in pose}
    fields["stamp"] = attributes.get("timestamp")
    return read_origin(payloads.OriginFields.model_validate(fields))


def _sensed(
    sensor: Sensor, robot_id: str, attributes: Mapping[str, Any]
) -> Observation:
    value = sensor.value.model_validate(attributes[sensor.attribute])
    return sensor.read(robot_id, read_origin(value), value)


_READERS: Mapping[str, Reader] = {
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
    **{sensor.attribute: partial(_sensed, sensor) for sensor in SENSORS},
}

_FRAMES = frozenset({names.BOXES, "class"})

_RANK = {name: rank for rank, name in enumerate(_READERS)}

_IDENTITY: Mapping[str, tuple[type[Odometry | LaserScan | DetectionFrame], str]] = {
    names.ODOMETRY: (Odometry, names.ODOMETRY),
    names.LIDAR: (LaserScan, names.LIDAR_HEADER),
    names.BOXES: (DetectionFrame, names.BOXES_HEADER),
}
"""Headers that carry the origin (boot, seq) of telemetry."""


def climate(_: str, attributes: Mapping[str, Any]) -> Climate:
    """Climate of the greenhouse."""
    value = payloads.ClimateValue.model_validate(dict(attributes))
    return Climate(value.temperature, value.relativeHumidity, value.co2)


def heartbeat(_: str, attributes: Mapping[str, Any]) -> HeartbeatProbe:
    """The probe that iVeg sends through the whole chain."""
    return HeartbeatProbe(
        read_origin(payloads.OriginFields.model_validate(attributes["probe"]))
    )
