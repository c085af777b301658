"""The attributes of an entity, one reader each.

Detection frames: boxes of one picture, and the classes of those nobody can use.

Scans: ranges and header to one sweep, field for field ``sensor_msgs/LaserScan``.

Values of small sensors, both ways, from what their observations declare.
"""

import math
from array import array
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, get_type_hints

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter, ValidationError, create_model

from iveg.domain.errors import UnreadableError
from iveg.domain.frames import may_be_laser_frame
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.kinds import SENSED, Kind
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    CommandStatus,
    Detection,
    DetectionFrame,
    GoalAnswer,
    HeartbeatProbe,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Overtaken,
    RefusedFrame,
    ReportedObstacle,
    RobotFault,
    SafetyReport,
)
from iveg.domain.quantities import Quantity, quantities_of
from iveg.ngsi import names, payloads
from iveg.ngsi.codec.fields import (
    ReadResult,
    first_complaint,
    merge,
    read_holds,
    read_origin,
    read_stamped,
    refuse_unplaced,
    unread,
)
from iveg.ngsi.payloads import OriginFields

_BOXES: TypeAdapter[list[payloads.BoxValue]] = TypeAdapter(list[payloads.BoxValue])


def read_frame(robot_id: str, attributes: Mapping[str, object]) -> DetectionFrame:
    """Read ``bounding_boxes`` and its header."""
    boxes = attributes[names.BOXES]
    if isinstance(boxes, dict):
        boxes = [boxes]
    if not isinstance(boxes, list) or len(boxes) > payloads.MAX_BOXES:
        raise UnreadableError("bad_bounding_boxes", "neither a box nor a short list")
    origin, detector = Origin(), None
    if attributes.get(names.BOXES_HEADER) is not None:
        header = payloads.BoxesHeaderValue.model_validate(
            attributes[names.BOXES_HEADER]
        )
        origin, detector = read_origin(header), header.detector
    try:
        read = list(map(_detection_of, _BOXES.validate_python(boxes)))
    except ValidationError:
        read = [_detection(box) for box in boxes]
    return _frame(robot_id, origin, boxes, read, detector)


def _frame(
    robot_id: str,
    origin: Origin,
    boxes: list[object],
    read: list[Detection | None],
    detector: str | None = None,
) -> DetectionFrame:
    """What could be read of a frame, and the classes of the boxes that could not."""
    found = tuple(one for one in read if one is not None)
    if len(found) == len(boxes):
        return DetectionFrame(robot_id, origin, found, (), detector)
    pairs = zip(boxes, read, strict=True)
    unread = tuple(_class_of(box) for box, detection in pairs if detection is None)
    return DetectionFrame(robot_id, origin, found, unread, detector)


def _class_of(box: object) -> str | None:
    class_id = box.get("class_id") if isinstance(box, dict) else None
    return payloads.clean_text(class_id) if isinstance(class_id, str) else None


def _detection(raw: object) -> Detection | None:
    try:
        return _detection_of(payloads.BoxValue.model_validate(raw))
    except ValidationError:
        return None


def _detection_of(box: payloads.BoxValue) -> Detection | None:
    if box.frame_id == names.UNPLACED:
        return None
    sides = box.position
    along, across = sides.xmax - sides.xmin, sides.ymax - sides.ymin
    is_somewhere = any((sides.xmin, sides.xmax, sides.ymin, sides.ymax))
    if not is_somewhere or max(along, across, sides.zmax - sides.zmin) > _LONGEST_M:
        return None
    position = Box3D(
        sides.xmin, sides.xmax, sides.ymin, sides.ymax, sides.zmin, sides.zmax
    )
    frame_id = box.frame_id or None
    class_id = str(box.class_id)[: payloads.MAX_TEXT]
    return Detection(class_id, box.probability, position, frame_id, box.det_id)


_LONGEST_M = 2 * LIMITS.zone_most_m
"""A box that is longer says no place."""
_HALF_M = 0.25
"""Algorithm 1 sends a point; it is drawn as a box of half a metre."""


def read_single_detection(
    robot_id: str, attributes: Mapping[str, object]
) -> DetectionFrame:
    """Read the one detection of Algorithm 1's payload."""
    box = {
        "class_id": attributes["class"],
        "probability": attributes.get("conf"),
        "frame_id": "map",
        "position": _sides_about(attributes.get("position_3D")),
    }
    return _frame(robot_id, read_stamped(attributes), [box], [_detection(box)])


def _sides_about(raw: object) -> dict[str, float] | None:
    """Sides of the box about a point; None where it is none, or three zeros."""
    try:
        point = payloads.PointValue.model_validate(raw)
    except ValidationError:
        return None
    centre = {"x": point.x, "y": point.y, "z": point.z}
    if not any(centre.values()):
        return None
    return {
        axis + side: value + sign * _HALF_M
        for axis, value in centre.items()
        for side, sign in (("min", -1), ("max", 1))
    }


_BASE_LINK = Pose2D(0.0, 0.0, 0.0)
_LIDAR_POINTS: TypeAdapter[list[float | None]] = TypeAdapter(payloads.LidarPoints)
_TURN = math.tau + 0.1
"""Drivers close their turn with a beam or two more (rad)."""
_FINEST = 1e-4
"""No laser is finer (rad); whoever draws a turn of beams needs room for each."""


def read_scan(robot_id: str, attributes: Mapping[str, object]) -> LaserScan:
    """Read ``lidar_points`` and its header."""
    return _scan_of(robot_id, attributes[names.LIDAR], attributes.get("lidar_header"))


def _scan_of(robot_id: str, points: object, raw_header: object) -> LaserScan:
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
    refuse_unplaced(raw_header)
    header = payloads.LidarHeaderValue.model_validate(raw_header)
    refuse_elsewhere(robot_id, header)
    _refuse_impossible(header, ranges.size)
    return LaserScan(
        robot_id,
        read_origin(header),
        header.angle_min,
        # The one beam of a scan needs none, but whoever draws it does.
        header.angle_increment if ranges.size > 1 else _FINEST,
        header.range_min,
        header.range_max,
        Pose2D(header.x, header.y, header.yaw),
        ranges,
    )


def _ranges(points: object) -> NDArray[np.float32]:
    """A scan's numbers as one buffer; inf where nothing came back.

    Raises:
        ValidationError: not a list of at most 4,096 numbers and nulls in range.
    """
    buffer = compact(points)
    if isinstance(buffer, np.ndarray):
        return buffer
    return ranges_of(_LIDAR_POINTS.validate_python(points))


def ranges_of(points: list[float | None]) -> NDArray[np.float32]:
    """Numbers of a scan (m); inf where nothing came back."""
    ranges = np.array(points, np.float32)
    ranges[np.isnan(ranges)] = np.inf
    return ranges


def compact(points: object) -> object:
    """Numbers as one buffer where nothing has to be judged; else what was given.

    That is: no null, no bool, all in range.  Hundreds of Python's numbers would have
    left the processor's cache when the scan is drawn.
    """
    if type(points) is not list or not 0 < len(points) <= payloads.MAX_BEAMS:
        return points
    try:
        numbers = np.frombuffer(array("d", points))
    except (TypeError, OverflowError):
        return points
    # A bool looks like 0 or 1 here.  "Not" also refuses NaN, which no JSON has.
    if not (numbers.min() >= 0.0 and numbers.max() <= payloads.MAX_RANGE_M):
        return points
    if np.any(numbers == 0.0) or np.any(numbers == 1.0):
        return points
    return numbers.astype(np.float32)


def _refuse_impossible(header: payloads.LidarHeaderValue, beams: int) -> None:
    """Refuse a sweep that no laser makes.

    Raises:
        UnreadableError: its beams do not turn, turn more than once, or count nothing.
    """
    increment = header.angle_increment
    if abs(increment) < _FINEST and beams > 1:
        raise UnreadableError("bad_lidar_header", "angle_increment is 0 or nearly so")
    if abs(increment) * (beams - 1) > _TURN:
        raise UnreadableError("bad_lidar_header", "beams turn more than once round")
    if not 0.0 <= header.range_min < header.range_max:
        raise UnreadableError("bad_lidar_header", "range_min is not below range_max")


def refuse_elsewhere(robot_id: str, header: payloads.ScanLabelValue) -> None:
    """Refuse a scan that is in no frame of a laser on this robot.

    Raises:
        UnreadableError: ``unknown_frame``.
    """
    if header.frame_id and not may_be_laser_frame(header.frame_id, robot_id):
        raise UnreadableError("unknown_frame", f"{names.LIDAR}: {header.frame_id}")


def read_single_scan(robot_id: str, attributes: Mapping[str, object]) -> LaserScan:
    """Read the sweep of Algorithm 1's payload."""
    return _scan_of(robot_id, attributes["laser_scan"], attributes.get("lidar_header"))


def _value_of(of: type[Observation]) -> type[OriginFields]:
    """The object on the wire: the origin, and each quantity within its bounds."""
    types = get_type_hints(of)
    members: dict[str, Any] = {
        name: (Annotated[types[name], _bounds(quantity)], None)
        for name, quantity in quantities_of(of).items()
    }
    return create_model(f"{of.__name__}Value", __base__=OriginFields, **members)


def _bounds(quantity: Quantity) -> object:
    return Field(ge=quantity.least, le=quantity.most)


_VALUES = {kind.of: _value_of(kind.of) for kind in SENSED}


def read_sensed(
    kind: Kind, robot_id: str, attributes: Mapping[str, object]
) -> Observation:
    """Read a small sensor's attribute, which has its name."""
    value = _VALUES[kind.of].model_validate(attributes[kind.name])
    said = {name: getattr(value, name) for name in quantities_of(kind.of)}
    return kind.of(robot_id, read_origin(value), **said)


Reader = Callable[[str, Mapping[str, object]], Observation]
Readers = Mapping[str, Reader]
NO_OTHERS: Readers = {}
IsPast = Callable[[str, type[Observation], str, int], bool]
"""Whether robot, kind, boot and seq tell that a message cannot be news."""


def read_attributes(
    robot_id: str,
    attributes: Mapping[str, object],
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
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
    robot_id: str, name: str, attributes: Mapping[str, object], is_past: IsPast
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
    source: str, reader: Reader, attributes: Mapping[str, object], name: str = ""
) -> ReadResult:
    """Result of one reader on an entity, or the reason of its failure."""
    try:
        names.refuse_another_robot(source, attributes, name)
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


def _odometry(robot_id: str, attributes: Mapping[str, object]) -> Odometry:
    refuse_unplaced(attributes[names.ODOMETRY])
    return _odometry_of(
        robot_id, payloads.OdometryValue.model_validate(attributes[names.ODOMETRY])
    )


def _odometry_of(robot_id: str, value: payloads.OdometryValue) -> Odometry:
    return Odometry(
        robot_id,
        read_origin(value),
        Pose2D(value.x, value.y, value.yaw),
        Twist2D(value.linear_velocity, value.angular_velocity),
        value.frame_id or None,
    )


def _safety(robot_id: str, attributes: Mapping[str, object]) -> SafetyReport:
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
        value.peer_scans is True,
        _obstacle(value.obstacle),
    )


def _obstacle(value: object) -> ReportedObstacle | None:
    """What a laser sees; what cannot be read is none, and never costs the holds."""
    try:
        one = payloads.ObstacleValue.model_validate(value)
    except ValidationError:
        return None
    return ReportedObstacle(one.x, one.y, one.width_m, one.moved)


def _navigation(robot_id: str, attributes: Mapping[str, object]) -> Navigation:
    value = payloads.NavigationValue.model_validate(attributes[names.NAVIGATION])
    return Navigation(
        robot_id,
        read_origin(value),
        value.task,
        None if value.goal is None else (value.goal.x, value.goal.y),
        tuple((point[0], point[1]) for point in value.path),
    )


def _command_status(robot_id: str, attributes: Mapping[str, object]) -> CommandStatus:
    return CommandStatus(
        robot_id, payloads.clean_text(str(attributes[names.COMMAND_STATUS]))
    )


def _command_info(robot_id: str, attributes: Mapping[str, object]) -> CommandAnswer:
    return command_answer(robot_id, {names.COMMAND: attributes[names.COMMAND_INFO]})


def command_answer(robot_id: str, attributes: Mapping[str, object]) -> CommandAnswer:
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


def _goal_info(robot_id: str, attributes: Mapping[str, object]) -> GoalAnswer:
    return goal_answer(robot_id, {names.GOAL: attributes[names.GOAL_INFO]})


def goal_answer(robot_id: str, attributes: Mapping[str, object]) -> GoalAnswer:
    """A robot's own word of a goal (docs/interfaces/commands.md)."""
    value = payloads.GoalAnswerValue.model_validate(attributes[names.GOAL])
    return GoalAnswer(robot_id, read_origin(value), value.id, value.r, value.why)


def _single_pose(robot_id: str, attributes: Mapping[str, object]) -> Odometry:
    value = payloads.OdometryValue.model_validate(attributes["pose"])
    odometry = _odometry_of(robot_id, value)
    if odometry.origin.stamp is None:
        origin = read_stamped(attributes)
        return replace(odometry, origin=origin)
    return odometry


_READERS: Mapping[str, Reader] = {
    names.ODOMETRY: _odometry,
    names.LIDAR: read_scan,
    names.BOXES: read_frame,
    names.SAFETY: _safety,
    names.NAVIGATION: _navigation,
    names.COMMAND_STATUS: _command_status,
    names.COMMAND_INFO: _command_info,
    names.GOAL_INFO: _goal_info,
    "pose": _single_pose,
    "laser_scan": read_single_scan,
    "class": read_single_detection,
    **{one.name: partial(read_sensed, one) for one in SENSED},
}

_FRAMES = frozenset({names.BOXES, "class"})

_RANK = {name: rank for rank, name in enumerate(_READERS)}

_IDENTITY: Mapping[str, tuple[type[Odometry | LaserScan | DetectionFrame], str]] = {
    names.ODOMETRY: (Odometry, names.ODOMETRY),
    names.LIDAR: (LaserScan, names.LIDAR_HEADER),
    names.BOXES: (DetectionFrame, names.BOXES_HEADER),
}
"""Headers that carry the origin (boot, seq) of telemetry."""


def climate(_: str, attributes: Mapping[str, object]) -> Climate:
    """Climate of the greenhouse."""
    value = payloads.ClimateValue.model_validate(dict(attributes))
    return Climate(value.temperature, value.relativeHumidity, value.co2)


def heartbeat(_: str, attributes: Mapping[str, object]) -> HeartbeatProbe:
    """The probe that iVeg sends through the whole chain."""
    return HeartbeatProbe(
        read_origin(payloads.OriginFields.model_validate(attributes["probe"]))
    )
