"""Observations as Foxglove's well-known messages, so that its viewers draw them.

Frames are ``map`` and ``{robot}/base_link``.
"""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from iveg.adapters.recordings.foxglove_schemas import (
    POSE_IN_FRAME,
    SCAN,
    SCENE,
    TRANSFORM,
)
from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Observation,
    Odometry,
)

Told = tuple[Channel, Mapping[str, Any]]
"""A message and its channel."""

_MAP, _BASE = "map", "base_link"
_SHOWN_S = 1.0
"""How long a box is drawn; the next picture takes its place before that."""


_TRANSFORMS = Channel("/tf", "foxglove.FrameTransform", TRANSFORM)


def channels_of(robot_id: str) -> tuple[Channel, ...]:
    """All channels that messages of a robot are told on."""
    return (
        _pose_channel(robot_id),
        _TRANSFORMS,
        _scan_channel(robot_id),
        _scene_channel(robot_id),
    )


def _pose_channel(robot_id: str) -> Channel:
    return Channel(f"/{robot_id}/pose", "foxglove.PoseInFrame", POSE_IN_FRAME)


def _scan_channel(robot_id: str) -> Channel:
    return Channel(f"/{robot_id}/scan", "foxglove.LaserScan", SCAN)


def _scene_channel(robot_id: str) -> Channel:
    return Channel(f"/{robot_id}/detections", "foxglove.SceneUpdate", SCENE)


def messages_of(observation: Observation, wall: float) -> Iterator[Told]:
    """What viewers draw of an observation that came at ``wall`` (Unix s)."""
    at, robot_id = _time(wall), observation.robot_id
    base = f"{robot_id}/{_BASE}"
    match observation:
        case Odometry(pose=pose):
            yield _pose(robot_id, at, pose)
            yield _transform(base, at, pose)
        case LaserScan():
            yield _scan(observation, base, at)
        case DetectionFrame():
            yield _scene(observation, base, at)


def _pose(robot_id: str, at: Mapping[str, int], pose: Pose2D) -> Told:
    message = {"timestamp": at, "frame_id": _MAP, "pose": _as_pose(pose)}
    return _pose_channel(robot_id), message


def _transform(base: str, at: Mapping[str, int], pose: Pose2D) -> Told:
    placed = _as_pose(pose)
    return _TRANSFORMS, {
        "timestamp": at,
        "parent_frame_id": _MAP,
        "child_frame_id": base,
        "translation": placed["position"],
        "rotation": placed["orientation"],
    }


def _scan(scan: LaserScan, base: str, at: Mapping[str, int]) -> Told:
    last = scan.angle_min + scan.angle_increment * max(0, scan.ranges.size - 1)
    return _scan_channel(scan.robot_id), {
        "timestamp": at,
        "frame_id": base,
        "pose": _as_pose(scan.mount),
        "start_angle": scan.angle_min,
        "end_angle": last,
        "ranges": [round(one, 3) for one in scan.ranges.tolist()],
        "intensities": [],
    }


def _scene(frame: DetectionFrame, base: str, at: Mapping[str, int]) -> Told:
    entities = [
        _entity(f"{frame.robot_id}-{number}", one, base, at)
        for number, one in enumerate(frame.detections)
    ]
    return _scene_channel(frame.robot_id), {"deletions": [], "entities": entities}


def _entity(
    name: str, seen: Detection, base: str, at: Mapping[str, int]
) -> Mapping[str, Any]:
    box = seen.box
    size = box.xmax - box.xmin, box.ymax - box.ymin, box.zmax - box.zmin
    frame = _MAP if seen.frame_id == _MAP else base
    cube = {
        "pose": {"position": _vector(*box.centre), "orientation": _turn(0.0)},
        "size": _vector(*size),
        "color": {"r": 1.0, "g": 0.6, "b": 0.0, "a": seen.probability},
    }
    facts = {"class": seen.class_id, "confidence": f"{seen.probability:.3f}"}
    return {
        "timestamp": at,
        "frame_id": frame,
        "id": name,
        "lifetime": _time(_SHOWN_S),
        "frame_locked": True,
        "metadata": [{"key": key, "value": value} for key, value in facts.items()],
        "cubes": [cube],
    }


def _time(seconds: float) -> Mapping[str, int]:
    whole = math.floor(seconds)
    return {"sec": whole, "nsec": int((seconds - whole) * 1e9)}


def _as_pose(pose: Pose2D) -> Mapping[str, Any]:
    return {"position": _vector(pose.x, pose.y), "orientation": _turn(pose.yaw)}


def _vector(x: float, y: float, z: float = 0.0) -> Mapping[str, float]:
    return {"x": x, "y": y, "z": z}


def _turn(yaw: float) -> Mapping[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
