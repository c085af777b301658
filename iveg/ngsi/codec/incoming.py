"""From Orion's notifications to observations.

A part that cannot be read becomes a ``Problem`` beside its neighbours and never hurts
them.

Scans that wait to be read: identity orders them, and numbers are for eyes.

Measures and answers of robots, straight from their topics.

Orders to one robot: a command, or the retained desired state.

Scans that iVeg hands on to robots which ask for them, both ways.
"""

from collections.abc import Container, Iterable, Mapping
from functools import partial
from typing import Literal

import numpy as np
import orjson
from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.goals import CancelOrder, GoalOrder
from iveg.domain.kinds import KIND_OF
from iveg.domain.observations import (
    DetectionFrame,
    EntityReading,
    LaserScan,
    Origin,
    UnreadScan,
)
from iveg.domain.peer_scan import PeerScan
from iveg.ngsi import names, payloads
from iveg.ngsi.codec.attributes import (
    NO_OTHERS,
    IsPast,
    Readers,
    climate,
    command_answer,
    compact,
    goal_answer,
    heartbeat,
    read_attributes,
    read_one,
    refuse_elsewhere,
    refused_frame,
)
from iveg.ngsi.codec.fields import (
    ReadResult,
    first_complaint,
    load_json,
    merge,
    read_origin,
    refuse_unplaced,
    rounded,
    unread,
)


def _unread_scan(
    name: str, robot_id: str, attributes: Mapping[str, object]
) -> UnreadScan:
    """A scan by its identity alone."""
    header = attributes.get(names.LIDAR_HEADER)
    origin = Origin()
    if header is not None:
        refuse_unplaced(header)
        label = payloads.ScanLabelValue.model_validate(header)
        refuse_elsewhere(robot_id, label)
        origin = read_origin(label)
    kept = {name: compact(attributes[name]), names.LIDAR_HEADER: header}
    return UnreadScan(robot_id, origin, partial(_read, robot_id, kept))


def _read(robot_id: str, attributes: Mapping[str, object]) -> LaserScan:
    """The scan.

    Raises:
        UnreadableError: it is none.
    """
    reading = read_attributes(robot_id, attributes)
    for scan in reading.observations:
        if isinstance(scan, LaserScan):
            return scan
    (problem,) = reading.problems
    raise UnreadableError(problem.reason, problem.detail)


UNREAD: Readers = {
    name: partial(_unread_scan, name) for name in (names.LIDAR, "laser_scan")
}
"""Readers that leave scans to those who draw them."""


_FRAME_SUFFIX = KIND_OF[DetectionFrame].suffix or ""


def read_measure(
    device_id: str,
    payload: bytes,
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
) -> ReadResult:
    """Read what a robot's device published on its ``attrs`` topic."""
    robot_id = names.robot_of_device(device_id)
    if not names.is_robot_id(robot_id):
        return unread(payloads.clean_text(device_id), "bad_robot_id")
    try:
        attributes = load_json(payload)
    except UnreadableError as error:
        read = unread(device_id, error.reason, error.detail)
    else:
        if isinstance(attributes, dict):
            return read_attributes(robot_id, attributes, is_past, instead)
        read = unread(device_id, "not_an_object")
    is_frame = device_id == robot_id + _FRAME_SUFFIX
    return refused_frame(robot_id, read) if is_frame else read


def read_answer(robot_id: str, payload: bytes) -> ReadResult:
    """Read a robot's answer on its ``cmdexe`` topic."""
    try:
        value = load_json(payload)
    except UnreadableError as error:
        return unread(robot_id, error.reason, error.detail)
    if not isinstance(value, dict):
        return unread(robot_id, "not_an_object")
    if names.GOAL in value and names.COMMAND not in value:
        return read_one(robot_id, goal_answer, value, names.GOAL)
    return read_one(robot_id, command_answer, value, names.COMMAND)


def read_notification(
    body: bytes,
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
    equipment: Container[tuple[str, str]] = frozenset(),
) -> tuple[str, ReadResult]:
    """Read a notification, normalized or keyValues.

    Args:
        body: JSON.
        is_past: Tells by its identity what need not be read; None reads all.
        instead: Other readers of some attributes, such as ``UNREAD``.
        equipment: Id and type of entities whose attributes are handed on as they are.

    Returns:
        The subscription's id and what its entities hold.

    Raises:
        UnreadableError: not a notification at all.
    """
    try:
        notification = payloads.NotificationValue.model_validate(load_json(body))
    except ValidationError as error:
        raise UnreadableError("not_a_notification", first_complaint(error)) from error
    entities = [
        read_entity(entity, is_past, instead, equipment) for entity in notification.data
    ]
    read = entities[0] if len(entities) == 1 else merge(entities)
    return notification.subscriptionId, read


def read_entity(
    entity: Mapping[str, object],
    is_past: IsPast | None = None,
    instead: Readers = NO_OTHERS,
    equipment: Container[tuple[str, str]] = frozenset(),
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
    if entity_type == names.ROBOT_TYPE:
        if not names.is_robot_id(entity_id):
            return unread(payloads.clean_text(entity_id), "bad_robot_id")
        return read_attributes(entity_id, attributes, is_past, instead)
    if (entity_id, entity_type) == (names.CLIMATE_ID, names.CLIMATE_TYPE):
        return read_one(entity_id, climate, attributes)
    if (entity_id, entity_type) == (names.HEARTBEAT_ID, names.HEARTBEAT_TYPE):
        return read_one(entity_id, heartbeat, attributes)
    if (entity_id, entity_type) in equipment:
        return ReadResult(equipment=(EntityReading(entity_id, attributes),))
    return unread(
        payloads.clean_text(entity_id),
        "foreign_entity",
        payloads.clean_text(entity_type),
    )


def _attribute_value(attribute: object) -> object:
    if isinstance(attribute, dict) and "value" in attribute and "type" in attribute:
        return attribute["value"]
    return attribute


def write_stop(hold_id: str, by: str) -> dict[str, object]:
    """The value of ``cmd`` that stops a robot."""
    return {"stop": {"id": hold_id, "by": by}}


def write_release(
    hold_ids: Iterable[str], challenge: str, attempt: str
) -> dict[str, object]:
    """The value of ``cmd`` that lifts exactly these holds.

    Args:
        hold_ids: Every remote hold of the robot.
        challenge: The robot's newest.
        attempt: Names this order, so that its copies are known for what they are.
    """
    return {"release": {"ids": list(hold_ids), "ch": challenge, "attempt": attempt}}


def write_resume(challenge: str, attempt: str) -> dict[str, object]:
    """The value of ``cmd`` that lets a released robot drive; as ``write_release``."""
    return {"resume": {"ch": challenge, "attempt": attempt}}


def write_goal(order: GoalOrder | CancelOrder) -> dict[str, object]:
    """The value of ``goal`` that gives a goal, or takes it back."""
    if isinstance(order, CancelOrder):
        return {"cancel": {"id": order.goal_id}}
    goal = order.goal
    fields = {"id": goal.goal_id, "kind": goal.kind, "x": goal.x, "y": goal.y}
    return {"set": {**fields, "ch": order.challenge, "until": order.until_s}}


def write_command(value: Mapping[str, object], name: str = names.COMMAND) -> bytes:
    """A command as the IoT Agent puts it on the robot's topic."""
    return orjson.dumps({name: value})


def write_desired(desired: Literal["stopped", "run"], ids: Iterable[str]) -> bytes:
    """The retained desired state on ``/{robot}/iveg/desired``."""
    return orjson.dumps({"desired": desired, "ids": list(ids)})


LARGEST = 1024
"""Size of a message at most (bytes)."""


def write_peer_scan(scan: PeerScan) -> bytes:
    """The bytes of ``/{robot}/iveg/peer_scan``."""
    centimetres = scan.ranges.astype(np.float64).round(2).tolist()
    return orjson.dumps(
        {
            "boot": scan.origin.boot,
            "seq": scan.origin.seq,
            "stamp": scan.origin.stamp,
            "robot_id": scan.robot_id,
            "robot_pose": {**_pose(scan.pose), "frame_id": "map"},
            "age_s": round(scan.age_s, 3),
            "mount": _pose(scan.mount),
            "range_max": round(scan.range_max, 3),
            "ranges": [None if one == np.inf else one for one in centimetres],
            "places": scan.places.tolist(),
        }
    )


def _pose(pose: Pose2D) -> dict[str, float | None]:
    return {"x": rounded(pose.x), "y": rounded(pose.y), "yaw": rounded(pose.yaw)}


def read_peer_scan(robot_id: str, payload: bytes) -> PeerScan:
    """Read ``/{robot}/iveg/peer_scan``.

    Raises:
        UnreadableError: ``too_large``, ``not_json``, ``not_a_peer_scan``, or
            ``another_robot`` than ``robot_id``.
    """
    if len(payload) > LARGEST:
        raise UnreadableError("too_large", f"{len(payload)} bytes")
    try:
        value = payloads.PeerScanValue.model_validate(load_json(payload))
    except ValidationError as error:
        raise UnreadableError("not_a_peer_scan", first_complaint(error)) from error
    if value.robot_id != robot_id:
        raise UnreadableError("another_robot", value.robot_id)
    pose, mount = value.robot_pose, value.mount
    ranges = np.array([np.inf if r is None else r for r in value.ranges], np.float32)
    return PeerScan(
        robot_id,
        read_origin(value),
        Pose2D(pose.x, pose.y, pose.yaw),
        value.age_s,
        Pose2D(mount.x, mount.y, mount.yaw),
        value.range_max,
        ranges,
        np.array(value.places, np.uint8),
    )
