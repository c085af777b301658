"""Messages for viewers such as Foxglove, made from observations at a lower rate.

``foxglove.json`` has the schemas (https://docs.foxglove.dev/docs/sdk/schemas).  Frames
are ``map`` and ``{robot}/base_link``.
"""

import math
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from typing import Any, Final

import numpy as np
import orjson

from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Observation,
    Odometry,
    Received,
    kind_of,
)

_SCHEMAS: Final = orjson.loads((files(__package__) / "foxglove.json").read_bytes())
_MAP, _BASE = "map", "base_link"
_SHOWN_S: Final = 1.0
"""Time for which a box is drawn (s); the next frame replaces it before."""
_DRAWN: Final = frozenset({Odometry, LaserScan, DetectionFrame})
DRAWN_APART_S: Final = 0.19
"""Least time between two messages of a kind of a robot (s): five a second, also where
jitter brings one a little early."""


class Drawing:
    """Converts observations of both transports as they arrive."""

    def __init__(self) -> None:
        self._due: dict[tuple[str, type[Observation]], float] = {}

    def messages(self, received: Received) -> Iterator[tuple[Channel, bytes]]:
        """Messages of an observation, if its kind is due."""
        observation, now = received.observation, received.at
        stream = observation.robot_id, kind_of(observation)
        if stream[1] not in _DRAWN or now.mono < self._due.get(stream, now.mono):
            return
        for channel, value in _drawn(observation, now.wall):
            self._due[stream] = now.mono + DRAWN_APART_S
            yield channel, orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY)


def _drawn(
    observation: Observation, wall: float
) -> Iterator[tuple[Channel, Mapping[str, Any]]]:
    """Messages of an observation that arrived at ``wall`` (Unix s)."""
    at, robot_id = _time(wall), observation.robot_id
    base = f"{robot_id}/{_BASE}"
    match observation:
        case Odometry(pose=pose):
            placed = _as_pose(pose)
            yield (
                _channel(f"/{robot_id}/pose", "PoseInFrame"),
                {"timestamp": at, "frame_id": _MAP, "pose": placed},
            )
            yield (
                _channel("/tf", "FrameTransform"),
                {
                    "timestamp": at,
                    "parent_frame_id": _MAP,
                    "child_frame_id": base,
                    "translation": placed["position"],
                    "rotation": placed["orientation"],
                },
            )
        case LaserScan(angle_min=first, angle_increment=step, ranges=ranges):
            yield (
                _channel(f"/{robot_id}/scan", "LaserScan"),
                {
                    "timestamp": at,
                    "frame_id": base,
                    "pose": _as_pose(observation.mount),
                    "start_angle": first,
                    "end_angle": first + step * max(0, ranges.size - 1),
                    "ranges": np.round(ranges, 3),
                    "intensities": [],
                },
            )
        case DetectionFrame(detections=detections):
            entities = [
                {"timestamp": at, "id": f"{robot_id}-{i}", **_entity(detection, base)}
                for i, detection in enumerate(detections)
            ]
            yield (
                _channel(f"/{robot_id}/detections", "SceneUpdate"),
                {"deletions": [], "entities": entities},
            )


@cache
def _channel(topic: str, schema: str) -> Channel:
    name = f"foxglove.{schema}"
    return Channel(topic, name, orjson.dumps(_SCHEMAS[name]))


def _entity(detection: Detection, base: str) -> Mapping[str, Any]:
    box = detection.box
    size = box.xmax - box.xmin, box.ymax - box.ymin, box.zmax - box.zmin
    cube = {
        "pose": {"position": _vector(*box.centre), "orientation": _turn(0.0)},
        "size": _vector(*size),
        "color": {"r": 1.0, "g": 0.6, "b": 0.0, "a": detection.probability},
    }
    facts = {"class": detection.class_id, "confidence": f"{detection.probability:.3f}"}
    return {
        "frame_id": _MAP if detection.frame_id == _MAP else base,
        "lifetime": _time(_SHOWN_S),
        "frame_locked": True,
        "metadata": [{"key": key, "value": value} for key, value in facts.items()],
        "cubes": [cube],
    }


def _time(seconds: float) -> Mapping[str, int]:
    return {"sec": math.floor(seconds), "nsec": int(seconds % 1 * 1e9)}


def _as_pose(pose: Pose2D) -> Mapping[str, Any]:
    return {"position": _vector(pose.x, pose.y), "orientation": _turn(pose.yaw)}


def _vector(x: float, y: float, z: float = 0.0) -> Mapping[str, float]:
    return {"x": x, "y": y, "z": z}


def _turn(yaw: float) -> Mapping[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}
