"""Messages for viewers such as Foxglove, made of those that came in, thinned.

``foxglove.json`` has the schemas (https://docs.foxglove.dev/docs/sdk/schemas).  Frames
are ``map`` and ``{robot}/base_link``.
"""

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from typing import Any

import orjson

from iveg.adapters.direct import DirectReader
from iveg.adapters.recordings.incoming import Incoming, Sort
from iveg.adapters.recordings.mcap_file import Channel
from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    Instant,
    LaserScan,
    Observation,
    Odometry,
    Received,
    kind_of,
)
from iveg.ngsi.codec import read_notification

Told = tuple[Channel, Mapping[str, Any]]
"""A message and its channel."""
_SCHEMAS = orjson.loads((files(__package__) / "foxglove.json").read_bytes())
_MAP, _BASE = "map", "base_link"
_SHOWN_S = 1.0
"""How long a box is drawn; the next picture takes its place before that."""


def _channel(topic: str, schema: str) -> Channel:
    return Channel(topic, f"foxglove.{schema}", _SCHEMAS[f"foxglove.{schema}"])


def messages_of(observation: Observation, wall: float) -> Iterator[Told]:
    """Messages for viewers, of an observation that came at ``wall`` (Unix s)."""
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
        case LaserScan():
            message = {"timestamp": at, "frame_id": base, **_scan(observation)}
            yield _channel(f"/{robot_id}/scan", "LaserScan"), message
        case DetectionFrame():
            entities = [
                {"timestamp": at, "id": f"{robot_id}-{number}", **_entity(one, base)}
                for number, one in enumerate(observation.detections)
            ]
            message = {"deletions": [], "entities": entities}
            yield _channel(f"/{robot_id}/detections", "SceneUpdate"), message


def _scan(scan: LaserScan) -> Mapping[str, Any]:
    last = scan.angle_min + scan.angle_increment * max(0, scan.ranges.size - 1)
    return {
        "pose": _as_pose(scan.mount),
        "start_angle": scan.angle_min,
        "end_angle": last,
        "ranges": [round(one, 3) for one in scan.ranges.tolist()],
        "intensities": [],
    }


def _entity(seen: Detection, base: str) -> Mapping[str, Any]:
    box = seen.box
    size = box.xmax - box.xmin, box.ymax - box.ymin, box.zmax - box.zmin
    cube = {
        "pose": {"position": _vector(*box.centre), "orientation": _turn(0.0)},
        "size": _vector(*size),
        "color": {"r": 1.0, "g": 0.6, "b": 0.0, "a": seen.probability},
    }
    facts = {"class": seen.class_id, "confidence": f"{seen.probability:.3f}"}
    return {
        "frame_id": _MAP if seen.frame_id == _MAP else base,
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


# --- thinned ----------------------------------------------------------------------

DRAWN_APART_S: dict[type[Observation], float] = {
    Odometry: 0.1,
    LaserScan: 0.2,
    DetectionFrame: 0.2,
}
"""What viewers draw, and the least time between two of a robot (s)."""
_EARLY = 0.95
_DRAWN = Odometry | LaserScan | DetectionFrame
_Stream = tuple[str, type[Observation]]


class Drawing:
    """Reads messages once more, for viewers alone.

    Args:
        apikey: First part of every measure topic.
        robots: The fleet.
    """

    def __init__(self, apikey: str, robots: Sequence[str]) -> None:
        self._robots = frozenset(robots)
        self._at = Instant(0.0, 0.0)
        self._found: list[Observation] = []
        self._due: dict[_Stream, float] = {}
        self._reader = DirectReader(apikey, robots, lambda: self._at, self)

    def messages(self, came: Incoming) -> Iterator[tuple[Channel, bytes]]:
        """Foxglove's messages of an input; none of what cannot be read."""
        self._at, self._found = came.at, []
        with contextlib.suppress(UnreadableError):
            self._read(came)
        for one in self._found:
            for channel, value in messages_of(one, came.at.wall):
                yield channel, orjson.dumps(value)

    def _read(self, came: Incoming) -> None:
        if came.sort is Sort.NOTIFICATION:
            _, reading = read_notification(came.payload, self.is_past)
            for one in reading.observations:
                with contextlib.suppress(UnreadableError):
                    self._draw(one)
        elif came.sort is Sort.MEASURE:
            stream = self._reader.stream(came.name)
            if stream is None or self._is_due(stream):
                self._reader.read(came.name, came.payload)

    def enqueue(self, received: Received) -> None:
        """Draw what the reader of measures has read."""
        self._draw(received.observation)

    def reject(self, source: str, reason: str, detail: str = "") -> None:
        """Draw nothing of what cannot be read."""

    def is_early(self, *_: object) -> bool:
        """None: what is not due was left before it was read."""
        return False

    def is_past(self, *_: object) -> bool:
        """Nothing: each message is drawn once."""
        return False

    def _draw(self, observation: Observation) -> None:
        """Have one drawn that is due."""
        stream = observation.robot_id, kind_of(observation)
        is_ours = observation.robot_id in self._robots
        if is_ours and isinstance(observation, _DRAWN) and self._is_due(stream):
            if isinstance(observation, LaserScan) and not observation.ranges.size:
                # A twin without its numbers takes nobody's turn.
                return
            self._found.append(observation)
            apart_s = DRAWN_APART_S[kind_of(observation)] * _EARLY
            self._due[stream] = self._at.mono + apart_s

    def _is_due(self, stream: _Stream) -> bool:
        is_drawn = stream[1] in DRAWN_APART_S
        return is_drawn and self._at.mono >= self._due.get(stream, float("-inf"))
