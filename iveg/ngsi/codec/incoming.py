"""Reader of messages from robots and Orion: measures, answers, entities, notifications.

An unreadable part becomes a problem and never affects the other parts.  Most kinds are
read by their declaration alone; frames, scans and the single payload of Algorithm 1
have readers of their own.
"""

import math
from collections.abc import Callable, Container, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.fleet import is_robot_id
from iveg.domain.frames import may_be_laser_frame
from iveg.domain.kinds import KIND_OF, KINDS, SENSED
from iveg.domain.limits import LIMITS
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    CommandStatus,
    Copy,
    Detection,
    DetectionFrame,
    EntityReading,
    GoalAnswer,
    HeartbeatProbe,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    RefusedFrame,
    SafetyReport,
)
from iveg.domain.wire import (
    MAX_BOXES,
    LidarPoints,
    Metres,
    Text,
    Wire,
    clean_text,
    place,
)
from iveg.ngsi import names
from iveg.ngsi.codec.fields import (
    ReadResult,
    adapter,
    first_complaint,
    load_json,
    merge,
    read_message,
    read_origin,
    read_stamped,
    refuse_unplaced,
    unread,
)

Reader = Callable[[str, Mapping[str, object]], Observation]
IsKnown = Callable[[str, type[Observation], object, object], bool]
"""Whether a robot's message of this kind, boot and count was taken before."""


# --- detection frames -------------------------------------------------------------

_BOX = TypeAdapter(Detection)
_BOXES: TypeAdapter[list[Detection]] = TypeAdapter(list[Detection])
_POINT: TypeAdapter[tuple[float, float, float]] = TypeAdapter(
    Annotated[tuple[Metres, Metres, Metres], *place("xyz")]
)
_LONGEST_M = 2 * LIMITS.zone_most_m
"""Longest side of a box that still says where somebody is (m)."""
_HALF_M = 0.25
"""Half the side of the box around Algorithm 1's point (m)."""


def _read_frame(robot_id: str, attributes: Mapping[str, object]) -> DetectionFrame:
    """Read ``bounding_boxes`` and its header."""
    boxes = attributes[names.BOXES]
    if isinstance(boxes, dict):
        boxes = [boxes]
    if not isinstance(boxes, list) or len(boxes) > MAX_BOXES:
        raise UnreadableError("bad_bounding_boxes", "neither a box nor a short list")
    header = attributes.get(names.BOXES_HEADER)
    parts = _sorted_boxes(boxes)
    if header is None:
        return DetectionFrame(robot_id, Origin(), **parts)
    return read_message(DetectionFrame, robot_id, header, **parts)


def _sorted_boxes(boxes: list[object]) -> dict[str, Any]:
    """Detections of a frame, and the classes of boxes without a usable position."""
    # All at once is faster; box by box only where a bad one hides among good ones.
    try:
        read: list[Detection | None] = [*_BOXES.validate_python(boxes)]
    except ValidationError:
        read = list(map(_detection, boxes))
    placed, classes = [], []
    for box, detection in zip(boxes, read, strict=True):
        if detection is not None and _is_somewhere(detection):
            placed.append(detection)
        else:
            # Never left out: somebody may be there, at an unknown place.
            classes.append(_class_of(box))
    return {"detections": tuple(placed), "unread": tuple(classes)}


def _detection(raw: object) -> Detection | None:
    with suppress(ValidationError):
        return _BOX.validate_python(raw)
    return None


def _is_somewhere(detection: Detection) -> bool:
    box = detection.box
    return (
        detection.frame_id != names.UNPLACED
        # Four zeros are unset fields, not a measured place.
        and any((box.xmin, box.xmax, box.ymin, box.ymax))
        and max(box.longer_side, box.zmax - box.zmin) <= _LONGEST_M
    )


def _class_of(box: object) -> str | None:
    class_id = box.get("class_id") if isinstance(box, dict) else None
    return clean_text(class_id) if isinstance(class_id, str) else None


def _read_single_detection(
    robot_id: str, attributes: Mapping[str, object]
) -> DetectionFrame:
    """Read the one detection of Algorithm 1's payload."""
    box = {
        "class_id": attributes["class"],
        "probability": attributes.get("conf"),
        "frame_id": "map",
        "position": _sides_about(attributes.get("position_3D")),
    }
    return DetectionFrame(robot_id, read_stamped(attributes), **_sorted_boxes([box]))


def _sides_about(raw: object) -> dict[str, float] | None:
    """Sides of the box around a point; None for no point, or three zeros."""
    try:
        centre = dict(zip("xyz", _POINT.validate_python(raw), strict=True))
    except ValidationError:
        return None
    if not any(centre.values()):
        return None
    return {
        axis + side: value + sign * _HALF_M
        for axis, value in centre.items()
        for side, sign in (("min", -1), ("max", 1))
    }


# --- scans ------------------------------------------------------------------------

_POINTS: TypeAdapter[list[float | None]] = TypeAdapter(LidarPoints)
_FRAME_NAME: TypeAdapter[str | None] = TypeAdapter(Text | None)
_UNSAID = {"range_min": 0.0, "x": 0.0, "y": 0.0, "yaw": 0.0}
"""Optional members of a header, with their defaults."""
_TURN = math.tau + 0.1
"""Greatest angle of a sweep (rad): some drivers end it with a beam or two more."""
_FINEST = 1e-4
"""Least angle between two beams (rad): finer than any laser, it would fill memory."""


def _read_scan(
    points: str, robot_id: str, attributes: Mapping[str, object]
) -> LaserScan:
    """Read a scan, whose ranges are the attribute ``points``, and its header."""
    ranges = ranges_of(_POINTS.validate_python(attributes[points]))
    header = attributes.get(names.LIDAR_HEADER)
    if header is None:
        header = {
            "angle_min": -math.pi,
            "angle_increment": math.tau / max(1, ranges.size),
            "range_max": 1e4,
        }
    _refuse_elsewhere(robot_id, header)
    if isinstance(header, dict):
        header = _UNSAID | header
    scan = read_message(LaserScan, robot_id, header, ranges=ranges)
    _refuse_impossible(scan)
    # A scan of one beam needs no increment, but its readers do.
    return scan if ranges.size > 1 else replace(scan, angle_increment=_FINEST)


def ranges_of(points: list[float | None]) -> NDArray[np.float32]:
    """Ranges of a scan (m); inf without a return."""
    ranges = np.array(points, np.float32)
    ranges[np.isnan(ranges)] = np.inf
    return ranges


def _refuse_impossible(scan: LaserScan) -> None:
    """Refuse a scan that no laser makes.

    Raises:
        UnreadableError: no angle between beams, more than a turn, or an empty range.
    """
    increment, beams = abs(scan.angle_increment), scan.ranges.size
    if increment < _FINEST and beams > 1:
        raise UnreadableError("bad_lidar_header", "angle_increment is 0 or nearly so")
    if increment * (beams - 1) > _TURN:
        raise UnreadableError("bad_lidar_header", "beams turn more than once round")
    if not 0.0 <= scan.range_min < scan.range_max:
        raise UnreadableError("bad_lidar_header", "range_min is not below range_max")


def _refuse_elsewhere(robot_id: str, header: object) -> None:
    """Refuse a scan whose frame is not that of a laser on this robot.

    Raises:
        UnreadableError: ``unplaced`` or ``unknown_frame``.
    """
    refuse_unplaced(header)
    if not isinstance(header, dict):
        return
    frame = _FRAME_NAME.validate_python(header.get("frame_id"))
    if frame and not may_be_laser_frame(frame, robot_id):
        raise UnreadableError("unknown_frame", f"{names.LIDAR}: {frame}")


# --- attributes -------------------------------------------------------------------


def _read_odometry(robot_id: str, attributes: Mapping[str, object]) -> Odometry:
    refuse_unplaced(attributes[names.ODOMETRY])
    return read_message(Odometry, robot_id, attributes[names.ODOMETRY])


def _read_status(robot_id: str, attributes: Mapping[str, object]) -> CommandStatus:
    return CommandStatus(robot_id, clean_text(str(attributes[names.COMMAND_STATUS])))


def _read_single_pose(robot_id: str, attributes: Mapping[str, object]) -> Odometry:
    """Read the pose of Algorithm 1's payload, whose stamp may stand beside it."""
    odometry = read_message(Odometry, robot_id, attributes["pose"])
    if odometry.origin.stamp is not None:
        return odometry
    return replace(odometry, origin=read_stamped(attributes))


def _declared(message: type[Observation], name: str) -> Reader:
    """Reader of an attribute by the declaration of its message."""

    def read(robot_id: str, attributes: Mapping[str, object]) -> Observation:
        return read_message(message, robot_id, attributes[name])

    return read


# The pose first: detections and scans of the same message need it.
_READERS: Mapping[str, Reader] = {
    names.ODOMETRY: _read_odometry,
    names.LIDAR: partial(_read_scan, names.LIDAR),
    names.BOXES: _read_frame,
    names.SAFETY: _declared(SafetyReport, names.SAFETY),
    names.NAVIGATION: _declared(Navigation, names.NAVIGATION),
    names.COMMAND_STATUS: _read_status,
    names.COMMAND_INFO: _declared(CommandAnswer, names.COMMAND_INFO),
    names.GOAL_INFO: _declared(GoalAnswer, names.GOAL_INFO),
    "pose": _read_single_pose,
    "laser_scan": partial(_read_scan, "laser_scan"),
    "class": _read_single_detection,
    **{kind.name: _declared(kind.type_, kind.name) for kind in SENSED},
}
_RANK = {name: rank for rank, name in enumerate(_READERS)}
_KIND_OF = {kind.attributes[0][0]: kind.type_ for kind in KINDS if kind.attributes}
_FRAMES = frozenset({names.BOXES, "class"})


def read_attributes(
    robot_id: str,
    attributes: Mapping[str, object],
    is_known: IsKnown = lambda *_: False,
) -> ReadResult:
    """Read the attributes of a robot that the contract defines; skip the others.

    Of a message that is known only the origin is read.
    """
    readings = [
        _read(robot_id, _reader(robot_id, attributes, name, is_known), attributes, name)
        for name in sorted(attributes.keys() & _READERS.keys(), key=_RANK.__getitem__)
        if attributes[name] is not None
    ]
    return merge(readings)


def _reader(
    robot_id: str, attributes: Mapping[str, object], name: str, is_known: IsKnown
) -> Reader:
    """Reader of an attribute, or of its origin alone if the message is known."""
    header, kind = attributes.get(names.HEADERS.get(name, name)), _KIND_OF.get(name)
    if (
        kind is not None
        and isinstance(header, dict)
        and is_known(robot_id, kind, header.get("boot"), header.get("seq"))
    ):
        return lambda robot_id, _: Copy(robot_id, read_origin(header), kind)
    return _READERS[name]


def _read(
    source: str, reader: Reader, attributes: Mapping[str, object], name: str
) -> ReadResult:
    """Result of a reader, or a problem with the reason of its failure."""
    try:
        names.refuse_another_robot(source, attributes, name)
        return ReadResult((reader(source, attributes),))
    except ValidationError as error:
        read = unread(source, f"bad_{name}", first_complaint(error))
    except UnreadableError as error:
        read = unread(source, error.reason, error.detail)
    except Exception as error:
        # A value that no bound foresaw must cost this attribute alone.
        read = unread(source, f"bad_{name}", repr(error))
    return _refused_frame(source, read) if name in _FRAMES else read


def _refused_frame(robot_id: str, read: ReadResult) -> ReadResult:
    """Result of an unreadable detection frame, which must not pass for an empty one."""
    return replace(read, observations=(RefusedFrame(robot_id),))


# --- messages of robots -----------------------------------------------------------

_FRAME_SUFFIX = KIND_OF[DetectionFrame].suffix or ""
_COMMAND = _declared(CommandAnswer, names.COMMAND)
_GOAL = _declared(GoalAnswer, names.GOAL)


def read_measure(device_id: str, payload: bytes) -> ReadResult:
    """Read a measure that a robot's device published on its ``attrs`` topic."""
    robot_id = names.robot_of_device(device_id)
    if not is_robot_id(robot_id):
        return unread(clean_text(device_id), "bad_robot_id")
    try:
        return read_attributes(robot_id, _load_object(payload))
    except UnreadableError as error:
        read = unread(device_id, error.reason, error.detail)
    is_frame = device_id == robot_id + _FRAME_SUFFIX
    return _refused_frame(robot_id, read) if is_frame else read


def _load_object(payload: bytes) -> dict[str, object]:
    value = load_json(payload)
    if not isinstance(value, dict):
        raise UnreadableError("not_an_object")
    return value


def read_answer(robot_id: str, payload: bytes) -> ReadResult:
    """Read a robot's answer on its ``cmdexe`` topic."""
    try:
        value = _load_object(payload)
    except UnreadableError as error:
        return unread(robot_id, error.reason, error.detail)
    if names.GOAL in value and names.COMMAND not in value:
        return _read(robot_id, _GOAL, value, names.GOAL)
    return _read(robot_id, _COMMAND, value, names.COMMAND)


# --- entities of Orion ------------------------------------------------------------


class _Notification(Wire):
    """A notification of Orion; entities are read attribute by attribute."""

    subscriptionId: Text  # noqa: N815 - NGSI name
    data: Annotated[list[dict[str, object]], Field(max_length=1000)]


def read_notification(
    body: bytes,
    equipment: Container[tuple[str, str]] = frozenset(),
    is_known: IsKnown = lambda *_: False,
) -> tuple[str, ReadResult]:
    """Read a notification, normalized or keyValues.

    Args:
        body: JSON.
        equipment: Id and type of entities whose attributes are handed on unread.
        is_known: Asked before the content of a robot's message is read.

    Returns:
        The subscription's id and the content of its entities.

    Raises:
        UnreadableError: the body is no notification.
    """
    try:
        notification = _Notification.model_validate(load_json(body))
    except ValidationError as error:
        raise UnreadableError("not_a_notification", first_complaint(error)) from error
    entities = [
        read_entity(entity, equipment, is_known) for entity in notification.data
    ]
    return notification.subscriptionId, merge(entities)


def read_entity(
    entity: Mapping[str, object],
    equipment: Container[tuple[str, str]] = frozenset(),
    is_known: IsKnown = lambda *_: False,
) -> ReadResult:
    """Read one NGSI-v2 entity in either representation."""
    entity_id, entity_type = entity.get("id"), entity.get("type")
    if not isinstance(entity_id, str) or not isinstance(entity_type, str):
        return unread("?", "not_an_entity", "an entity needs id and type")
    attributes = {
        name: _attribute_value(value)
        for name, value in entity.items()
        if name not in ("id", "type")
    }
    identity = entity_id, entity_type
    if entity_type == names.ROBOT_TYPE:
        if not is_robot_id(entity_id):
            return unread(clean_text(entity_id), "bad_robot_id")
        return read_attributes(entity_id, attributes, is_known)
    if identity == (names.CLIMATE_ID, names.CLIMATE_TYPE):
        return _read(entity_id, _read_climate, attributes, "entity")
    if identity == (names.HEARTBEAT_ID, names.HEARTBEAT_TYPE):
        return _read(entity_id, _read_heartbeat, attributes, "entity")
    if identity in equipment:
        return ReadResult(equipment=(EntityReading(entity_id, attributes),))
    return unread(clean_text(entity_id), "foreign_entity", clean_text(entity_type))


def _attribute_value(attribute: object) -> object:
    if isinstance(attribute, dict) and "value" in attribute and "type" in attribute:
        return attribute["value"]
    return attribute


def _read_climate(_: str, attributes: Mapping[str, object]) -> Climate:
    return adapter(Climate).validate_python(dict(attributes))


def _read_heartbeat(_: str, attributes: Mapping[str, object]) -> HeartbeatProbe:
    """Read the probe that iVeg sends through the whole data path."""
    return HeartbeatProbe(read_origin(attributes["probe"]))
