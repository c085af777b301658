"""Messages of robots and sensors; the inverse of the readers."""

from collections.abc import Iterable

import orjson

from iveg.domain.kinds import kind
from iveg.domain.observations import (
    Climate,
    CommandAnswer,
    DetectionFrame,
    GoalAnswer,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    ReportedObstacle,
    SafetyReport,
    Unplaced,
)
from iveg.domain.quantities import value_of
from iveg.ngsi import names
from iveg.ngsi.codec.fields import (
    rounded,
    without_none,
    write_hold,
    write_lidar_header,
    write_motion,
    write_origin,
)


def write_odometry(value: Odometry) -> bytes:
    """The bytes of ``/{apikey}/{robot}_odom/attrs``."""
    return _measure(
        value.origin,
        {
            names.ODOMETRY: {
                **write_motion(value.pose, value.twist),
                **write_origin(value.origin),
            }
        },
    )


def write_scan(value: LaserScan) -> bytes:
    """The bytes of ``/{apikey}/{robot}_lidar2D/attrs``; no return is ``null``."""
    return _measure(
        value.origin,
        {
            names.LIDAR: value.ranges,
            names.LIDAR_HEADER: write_lidar_header(value, write_origin(value.origin)),
        },
    )


def write_detections(value: DetectionFrame) -> bytes:
    """The bytes of ``/{apikey}/{robot}_yolox_bounding_boxes/attrs``."""
    boxes: list[dict[str, object]] = [
        without_none(
            {
                "class_id": detection.class_id,
                "probability": round(detection.probability, 4),
                "position": {
                    "xmin": round(detection.box.xmin, 4),
                    "xmax": round(detection.box.xmax, 4),
                    "ymin": round(detection.box.ymin, 4),
                    "ymax": round(detection.box.ymax, 4),
                    "zmin": round(detection.box.zmin, 4),
                    "zmax": round(detection.box.zmax, 4),
                },
                "frame_id": detection.frame_id,
                "det_id": detection.det_id,
            }
        )
        for detection in value.detections
    ]
    # Somebody is there and nobody knows where: that must not look like an empty frame.
    boxes += write_unread(value.unread)
    header = write_origin(value.origin)
    if value.detector is not None:
        header["detector"] = value.detector
    return _measure(value.origin, {names.BOXES: boxes, names.BOXES_HEADER: header})


def write_unread(unread: Iterable[str | None]) -> list[dict[str, object]]:
    """Boxes of somebody or something whose place is not known."""
    return [
        without_none({"class_id": class_id, "frame_id": names.UNPLACED})
        for class_id in unread
    ]


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
                "holds": [write_hold(hold) for hold in value.holds],
                "released": list(value.released),
                "ch": value.challenge,
                "v": round(value.linear, 4),
                "w": round(value.angular, 4),
                "feedback_age_s": rounded(value.feedback_age_s),
                **_faults(value),
                **({"peer_scans": True} if value.peer_scans else {}),
                **_obstacle(value.obstacle),
                **write_origin(value.origin),
            }
        },
    )


def _faults(value: SafetyReport) -> dict[str, object]:
    found = [
        {"code": one.code, "about": one.about, "for_s": rounded(one.for_s)}
        for one in value.faults
    ]
    return {"faults": found} if found else {}


def _obstacle(value: ReportedObstacle | None) -> dict[str, object]:
    if value is None:
        return {}
    x, y, width = (round(one, 2) for one in (value.x, value.y, value.width_m))
    return {"obstacle": {"x": x, "y": y, "width_m": width, "moved": value.moved}}


def write_unplaced(value: Unplaced) -> bytes:
    """The bytes of odometry or a scan that has no place: read as such, or not at all.

    Without numbers for x, y and yaw a reader that does not know ``unplaced`` refuses
    the whole, so that nobody can draw it in a wrong place.
    """
    nowhere = {
        "frame_id": names.UNPLACED,
        "x": None,
        "y": None,
        "yaw": None,
        **write_origin(value.origin),
    }
    if value.kind == "scan":
        return _measure(value.origin, {names.LIDAR: [], names.LIDAR_HEADER: nowhere})
    if value.twist is not None:
        nowhere["linear_velocity"] = round(value.twist.linear_x, 4)
        nowhere["angular_velocity"] = round(value.twist.angular_z, 4)
    return _measure(value.origin, {names.ODOMETRY: nowhere})


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
                **write_origin(value.origin),
            }
        },
    )


def write_sensed(value: Observation) -> bytes:
    """The bytes of a small sensor's topic, ``/{apikey}/{robot}_{name}/attrs``."""
    fields = {**value_of(value), **write_origin(value.origin)}
    return _measure(value.origin, {kind(value).name: fields})


def write_answer(value: CommandAnswer) -> bytes:
    """The bytes of ``/{apikey}/{robot}/cmdexe``."""
    return orjson.dumps(
        {
            names.COMMAND: {
                "id": value.id,
                "r": value.result,
                "holds": [write_hold(hold) for hold in value.holds],
                "ch": value.challenge,
                "v": round(value.linear, 4),
                "boot": value.origin.boot,
                "seq": value.origin.seq,
                "why": value.why,
                "attempt": value.attempt,
                **_mark(value.origin),
            }
        }
    )


def write_goal_answer(value: GoalAnswer) -> bytes:
    """The bytes of ``/{apikey}/{robot}/cmdexe`` that tell of a goal."""
    fields = {"id": value.id, "r": value.result, "why": value.why}
    return orjson.dumps({names.GOAL: fields | write_origin(value.origin)})


def _mark(origin: Origin) -> dict[str, str]:
    return {} if origin.replay is None else {"replay": origin.replay}


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


def write_heartbeat(origin: Origin) -> bytes:
    """The bytes of ``/{apikey}/iveg-canary/attrs``."""
    return _measure(origin, {"probe": write_origin(origin)})


def _measure(origin: Origin, attributes: dict[str, object]) -> bytes:
    if origin.stamp is not None:
        attributes["TimeInstant"] = origin.stamp
    return orjson.dumps(attributes, option=orjson.OPT_SERIALIZE_NUMPY)
