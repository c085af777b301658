"""Between the wire and the domain, both ways, without I/O.

``read_…`` takes bytes to observations; a part that cannot be read becomes a
``Problem`` beside its neighbours and never hurts them.  ``write_…`` is its inverse.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

import numpy as np
import orjson
from pydantic import TypeAdapter, ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import Feedback, FeedbackAlert, Mandate
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Canary,
    Climate,
    CommandAnswer,
    CommandStatus,
    Detection,
    DetectionFrame,
    Hold,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    SafetyReport,
)
from iveg.ngsi import names, payloads

MAX_DEPTH = 32
_BASE_LINK = Pose2D(0.0, 0.0, 0.0)
_LIDAR_POINTS: TypeAdapter[list[float | None]] = TypeAdapter(payloads.LidarPoints)


@dataclass(frozen=True, slots=True)
class Problem:
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
class Reading:
    """What a message held: what could be read and what could not."""

    observations: tuple[Observation, ...] = ()
    problems: tuple[Problem, ...] = ()


# --- JSON at the door -------------------------------------------------------------


def load_json(body: bytes | str) -> Any:
    """Parse JSON that may be hostile.

    Raises:
        UnreadableError: not JSON (NaN and Infinity are not), or deeper than 32.
    """
    try:
        value = orjson.loads(body)
    except orjson.JSONDecodeError as error:
        raise UnreadableError("not_json", str(error)) from error
    if _deeper_than(value, MAX_DEPTH):
        raise UnreadableError("too_deep", f"more than {MAX_DEPTH} levels")
    return value


def _deeper_than(value: Any, limit: int) -> bool:
    if isinstance(value, dict):
        value = value.values()
    elif isinstance(value, list):
        if value and type(value[0]) in (float, int):
            value = [part for part in value if type(part) in (dict, list)]
    else:
        return False
    return limit == 0 or any(_deeper_than(part, limit - 1) for part in value)


# --- Orion → iVeg -----------------------------------------------------------------


def read_notification(body: bytes) -> tuple[str, Reading]:
    """Read a notification, normalized or keyValues.

    Returns:
        The subscription's id and what its entities hold.

    Raises:
        UnreadableError: not a notification at all.
    """
    try:
        notification = payloads.NotificationValue.model_validate(load_json(body))
    except ValidationError as error:
        raise UnreadableError("not_a_notification", _first(error)) from error
    return notification.subscriptionId, _merge(
        read_entity(entity) for entity in notification.data
    )


def read_entity(entity: Mapping[str, Any]) -> Reading:
    """Read one NGSI-v2 entity in either representation."""
    entity_id, entity_type = entity.get("id"), entity.get("type")
    if not isinstance(entity_id, str) or not isinstance(entity_type, str):
        return _problem("?", "not_an_entity", "an entity needs id and type")
    attributes = {
        name: _attribute_value(value)
        for name, value in entity.items()
        if name not in ("id", "type")
    }
    if entity_type == names.ROBOT_TYPE:
        if not names.is_robot_id(entity_id):
            return _problem(payloads.clean_text(entity_id), "bad_robot_id")
        return read_attributes(entity_id, attributes)
    if (entity_id, entity_type) == (names.CLIMATE_ID, names.CLIMATE_TYPE):
        return _read_one(entity_id, _climate, attributes)
    if (entity_id, entity_type) == (names.CANARY_ID, names.CANARY_TYPE):
        return _read_one(entity_id, _canary, attributes)
    return _problem(
        payloads.clean_text(entity_id),
        "foreign_entity",
        payloads.clean_text(entity_type),
    )


def _attribute_value(attribute: Any) -> Any:
    if isinstance(attribute, dict) and "value" in attribute and "type" in attribute:
        return attribute["value"]
    return attribute


# --- MQTT → iVeg ------------------------------------------------------------------


def read_measure(device_id: str, payload: bytes) -> Reading:
    """Read what a robot's device published on its ``attrs`` topic."""
    robot_id = names.robot_of_device(device_id)
    if not names.is_robot_id(robot_id):
        return _problem(payloads.clean_text(device_id), "bad_robot_id")
    try:
        attributes = load_json(payload)
    except UnreadableError as error:
        return _problem(device_id, error.reason, error.detail)
    if not isinstance(attributes, dict):
        return _problem(device_id, "not_an_object")
    return read_attributes(robot_id, attributes)


def read_answer(robot_id: str, payload: bytes) -> Reading:
    """Read a robot's answer on its ``cmdexe`` topic."""
    try:
        value = load_json(payload)
    except UnreadableError as error:
        return _problem(robot_id, error.reason, error.detail)
    if not isinstance(value, dict):
        return _problem(robot_id, "not_an_object")
    return _read_one(robot_id, _answer, value, names.COMMAND)


# --- attributes of a robot --------------------------------------------------------

_Reader = Callable[[str, Any], Observation]


def read_attributes(robot_id: str, attributes: Mapping[str, Any]) -> Reading:
    """Read every attribute of a robot that the contract knows; skip the others."""
    readings = []
    for name, reader in _READERS.items():
        if attributes.get(name) is not None:
            readings.append(_read_one(robot_id, reader, attributes, name))
    return _merge(readings)


def _read_one(
    source: str, reader: _Reader, attributes: Mapping[str, Any], name: str = ""
) -> Reading:
    try:
        return Reading((reader(source, attributes),))
    except ValidationError as error:
        return _problem(source, f"bad_{name or 'entity'}", _first(error))
    except UnreadableError as error:
        return _problem(source, error.reason, error.detail)


def _odometry(robot_id: str, attributes: Mapping[str, Any]) -> Odometry:
    return _odometry_of(
        robot_id, payloads.OdometryValue.model_validate(attributes[names.ODOMETRY])
    )


def _odometry_of(robot_id: str, value: payloads.OdometryValue) -> Odometry:
    return Odometry(
        robot_id,
        _origin(value),
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
        _origin(header),
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
        origin = _origin(
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
        _origin(value),
        value.speed_factor,
        value.reason,
        value.cause,
        value.decision_id,
        _holds(value.holds),
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
        _origin(value),
        value.task,
        None if value.goal is None else (value.goal.x, value.goal.y),
        tuple((point[0], point[1]) for point in value.path),
    )


def _command_status(robot_id: str, attributes: Mapping[str, Any]) -> CommandStatus:
    return CommandStatus(
        robot_id, payloads.clean_text(str(attributes[names.COMMAND_STATUS]))
    )


def _command_info(robot_id: str, attributes: Mapping[str, Any]) -> CommandAnswer:
    return _answer(robot_id, {names.COMMAND: attributes[names.COMMAND_INFO]})


def _answer(robot_id: str, attributes: Mapping[str, Any]) -> CommandAnswer:
    value = payloads.AnswerValue.model_validate(attributes.get(names.COMMAND))
    return CommandAnswer(
        robot_id,
        _origin(value),
        value.id,
        value.r,
        _holds(value.holds),
        value.ch,
        value.v,
        value.why,
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


def _stamped(attributes: Mapping[str, Any]) -> Origin:
    return _origin(
        payloads.OriginFields.model_validate({"stamp": attributes.get("timestamp")})
    )


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


def _climate(_: str, attributes: Mapping[str, Any]) -> Climate:
    value = payloads.ClimateValue.model_validate(dict(attributes))
    return Climate(value.temperature, value.relativeHumidity, value.co2)


def _canary(_: str, attributes: Mapping[str, Any]) -> Canary:
    return Canary(_origin(payloads.OriginFields.model_validate(attributes["probe"])))


# --- iVeg ↔ robots ----------------------------------------------------------------


def read_feedback(payload: bytes) -> Feedback:
    """Read ``/{robot}/mqtt_feedback``.

    Raises:
        UnreadableError: not a feedback; counts as no feedback (safety.md §3.5).
    """
    try:
        value = payloads.FeedbackValue.model_validate(load_json(payload))
    except ValidationError as error:
        raise UnreadableError("not_feedback", _first(error)) from error
    pose = value.robot_pose
    return Feedback(
        value.robot_id,
        _origin(value),
        None if value.alert is None else _alert(value.alert),
        tuple(_alert(alert) for alert in value.alerts),
        None if pose is None else Pose2D(pose.x, pose.y, pose.yaw),
        None if pose is None else Twist2D(pose.linear_velocity, pose.angular_velocity),
        None if pose is None else pose.stamp,
        {
            robot_id: Mandate(
                mandate.speed_factor,
                mandate.reason,
                mandate.cause,
                mandate.distance_m,
                mandate.decision_id,
            )
            for robot_id, mandate in value.mandates.items()
        },
        value.seen,
    )


def _alert(value: payloads.AlertValue) -> FeedbackAlert:
    position = value.position
    return FeedbackAlert(
        value.decision_id or "",
        value.stamp or "",
        value.class_,
        value.class_id,
        value.conf,
        None if position is None else (position.x, position.y, position.z),
        value.radius_m,
        value.observer,
    )


def write_feedback(feedback: Feedback) -> bytes:
    """The bytes of ``/{robot}/mqtt_feedback``."""
    return orjson.dumps(
        {
            **_origin_fields(feedback.origin),
            "robot_id": feedback.robot_id,
            "alert": None if feedback.alert is None else _write_alert(feedback.alert),
            "alerts": [_write_alert(alert) for alert in feedback.alerts],
            "robot_pose": _write_feedback_pose(feedback),
            "mandates": {
                robot_id: _without_none(
                    {
                        "speed_factor": mandate.speed_factor,
                        "reason": mandate.reason,
                        "cause": mandate.cause,
                        "distance_m": _rounded(mandate.distance_m),
                        "decision_id": mandate.decision_id,
                    }
                )
                for robot_id, mandate in feedback.mandates.items()
            },
            "seen": dict(feedback.seen),
        }
    )


def _write_alert(alert: FeedbackAlert) -> dict[str, Any]:
    position = alert.position
    return _without_none(
        {
            "decision_id": alert.decision_id or None,
            "class": alert.class_,
            "class_id": alert.class_id,
            "conf": _rounded(alert.confidence),
            "position": None
            if position is None
            else dict(zip("xyz", map(_rounded, position), strict=True)),
            "radius_m": _rounded(alert.radius_m),
            "stamp": alert.stamp,
            "observer": alert.observer,
        }
    )


def _write_feedback_pose(feedback: Feedback) -> dict[str, Any] | None:
    if feedback.pose is None:
        return None
    twist = feedback.twist or Twist2D(0.0, 0.0)
    return {
        "x": feedback.pose.x,
        "y": feedback.pose.y,
        "yaw": feedback.pose.yaw,
        "linear_velocity": twist.linear_x,
        "angular_velocity": twist.angular_z,
        "stamp": feedback.pose_stamp,
    }


def write_stop(hold_id: str, by: str) -> dict[str, Any]:
    """The value of ``cmd`` that stops a robot."""
    return {"stop": {"id": hold_id, "by": by}}


def write_release(hold_ids: Iterable[str], challenge: str) -> dict[str, Any]:
    """The value of ``cmd`` that lifts exactly these holds."""
    return {"release": {"ids": list(hold_ids), "ch": challenge}}


def write_resume(challenge: str) -> dict[str, Any]:
    """The value of ``cmd`` that lets a released robot drive."""
    return {"resume": {"ch": challenge}}


def write_command(value: Mapping[str, Any]) -> bytes:
    """A command as the IoT Agent puts it on the robot's topic."""
    return orjson.dumps({names.COMMAND: value})


def write_desired(desired: Literal["stopped", "run"], ids: Iterable[str]) -> bytes:
    """The retained level on ``/{robot}/iveg/desired``."""
    return orjson.dumps({"desired": desired, "ids": list(ids)})


# --- robot → cloud ----------------------------------------------------------------


def write_odometry(value: Odometry) -> bytes:
    """The bytes of ``/{apikey}/{robot}_odom/attrs``."""
    return _measure(
        value.origin,
        {
            names.ODOMETRY: {
                "x": round(value.pose.x, 4),
                "y": round(value.pose.y, 4),
                "yaw": round(value.pose.yaw, 5),
                "linear_velocity": round(value.twist.linear_x, 4),
                "angular_velocity": round(value.twist.angular_z, 4),
                **_origin_fields(value.origin),
            }
        },
    )


def write_scan(value: LaserScan) -> bytes:
    """The bytes of ``/{apikey}/{robot}_lidar2D/attrs``; no return is ``null``."""
    return _measure(
        value.origin,
        {
            names.LIDAR: np.round(value.ranges.astype(np.float64), 3),
            names.LIDAR_HEADER: {
                "angle_min": value.angle_min,
                "angle_increment": value.angle_increment,
                "range_min": value.range_min,
                "range_max": value.range_max,
                "x": value.mount.x,
                "y": value.mount.y,
                "yaw": value.mount.yaw,
                **_origin_fields(value.origin),
            },
        },
    )


def write_detections(value: DetectionFrame) -> bytes:
    """The bytes of ``/{apikey}/{robot}_yolox_bounding_boxes/attrs``."""
    boxes = [
        _without_none(
            {
                "class_id": detection.class_id,
                "probability": round(detection.probability, 4),
                "position": {
                    side: round(getattr(detection.box, side), 4)
                    for side in ("xmin", "xmax", "ymin", "ymax", "zmin", "zmax")
                },
                "frame_id": detection.frame_id,
                "det_id": detection.det_id,
            }
        )
        for detection in value.detections
    ]
    return _measure(
        value.origin,
        {names.BOXES: boxes, names.BOXES_HEADER: _origin_fields(value.origin)},
    )


def write_safety(value: SafetyReport) -> bytes:
    """The bytes of ``/{apikey}/{robot}_safety/attrs``."""
    return _measure(
        value.origin,
        {
            names.SAFETY: {
                "speed_factor": value.speed_factor,
                "reason": value.reason,
                "cause": value.cause,
                "decision_id": value.decision_id,
                "holds": [_write_hold(hold) for hold in value.holds],
                "released": list(value.released),
                "ch": value.challenge,
                "v": round(value.linear, 4),
                "w": round(value.angular, 4),
                "feedback_age_s": _rounded(value.feedback_age_s),
                **_origin_fields(value.origin),
            }
        },
    )


def write_navigation(value: Navigation) -> bytes:
    """The bytes of ``/{apikey}/{robot}_nav/attrs``."""
    return _measure(
        value.origin,
        {
            names.NAVIGATION: {
                "task": value.task,
                "goal": None
                if value.goal is None
                else {"x": round(value.goal[0], 3), "y": round(value.goal[1], 3)},
                "path": [[round(x, 3), round(y, 3)] for x, y in value.path],
                **_origin_fields(value.origin),
            }
        },
    )


def write_answer(value: CommandAnswer) -> bytes:
    """The bytes of ``/{apikey}/{robot}/cmdexe``."""
    return orjson.dumps(
        {
            names.COMMAND: {
                "id": value.id,
                "r": value.result,
                "holds": [_write_hold(hold) for hold in value.holds],
                "ch": value.challenge,
                "v": round(value.linear, 4),
                "boot": value.origin.boot,
                "seq": value.origin.seq,
                "why": value.why,
            }
        }
    )


def write_climate(value: Climate, stamp: str) -> bytes:
    """The bytes of ``/{apikey}/climate/attrs``."""
    return orjson.dumps(
        {
            "temperature": value.temperature,
            "relativeHumidity": value.relative_humidity,
            "co2": value.co2,
            "TimeInstant": stamp,
        }
    )


def write_canary(origin: Origin) -> bytes:
    """The bytes of ``/{apikey}/iveg-canary/attrs``."""
    return _measure(origin, {"probe": _origin_fields(origin)})


def _measure(origin: Origin, attributes: dict[str, Any]) -> bytes:
    if origin.stamp is not None:
        attributes["TimeInstant"] = origin.stamp
    return orjson.dumps(attributes, option=orjson.OPT_SERIALIZE_NUMPY)


# --- small shared pieces ----------------------------------------------------------


def format_stamp(wall: float) -> str:
    """Unix seconds as the contract's ISO-8601 UTC with milliseconds."""
    stamp = datetime.fromtimestamp(wall, UTC).isoformat(timespec="milliseconds")
    return stamp.removesuffix("+00:00") + "Z"


def parse_stamp(text: str) -> float | None:
    """Unix seconds of an ISO-8601 text; None where it is none."""
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        return None
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=UTC)
    return moment.timestamp()


def _origin(value: payloads.OriginFields) -> Origin:
    stamp_s = None if value.stamp is None else parse_stamp(value.stamp)
    return Origin(value.boot, value.seq, value.stamp, stamp_s)


def _origin_fields(origin: Origin) -> dict[str, Any]:
    return {"boot": origin.boot, "seq": origin.seq, "stamp": origin.stamp}


def _holds(values: Iterable[payloads.HoldValue]) -> tuple[Hold, ...]:
    return tuple(Hold(value.id, value.source, value.ack) for value in values)


def _write_hold(hold: Hold) -> dict[str, str]:
    return {"id": hold.id, "source": hold.source, "ack": hold.ack}


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)


def _without_none(fields: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in fields.items() if value is not None}


def _problem(source: str, reason: str, detail: str = "") -> Reading:
    return Reading(problems=(Problem(source, reason, detail),))


def _merge(readings: Iterable[Reading]) -> Reading:
    observations: list[Observation] = []
    problems: list[Problem] = []
    for reading in readings:
        observations.extend(reading.observations)
        problems.extend(reading.problems)
    return Reading(tuple(observations), tuple(problems))


def _first(error: ValidationError) -> str:
    """The first complaint of pydantic, without echoing the input."""
    complaint = error.errors(include_input=False, include_url=False)[0]
    place = ".".join(str(part) for part in complaint["loc"])
    return payloads.clean_text(f"{place}: {complaint['msg']}")
