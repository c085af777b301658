"""Algorithm 1 on a ROS 2 robot: newest message of each topic, transformed to ``map``.

A missing or old transform makes an observation unplaced, and the fault names it; no old
transform is used.  Of all pending messages only the newest is read, so a flood costs no
more than its bytes.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    Detection,
    DetectionFrame,
    Instant,
    Observation,
    Odometry,
    Unplaced,
)
from iveg.robot.grounding.locate import Grounding
from iveg.robot.ros2 import pictures, reading
from iveg.robot.ros2.config import RobotConfig, Topics
from iveg.robot.ros2.input_faults import InputFaults
from iveg.robot.ros2.rigid import RigidTransform
from iveg.robot.ros2.sensors import ROS_SENSORS
from iveg.robot.ros2.transforms import NoTransformError, TransformBuffer
from iveg.ros2 import cdr
from iveg.ros2 import messages as m
from iveg.ros2.schema import Message

TOPICS: dict[str, type[Message]] = {
    "odometry": m.Odometry,
    "scan": m.LaserScan,
    "detections_3d": m.Detection3DArray,
    "detections_2d": m.Detection2DArray,
    "depth": m.Image,
    "camera_info": m.CameraInfo,
    "mask": m.Image,
    **{name: one.message for name, one in ROS_SENSORS.items()},
    "path": m.Path,
    "tf_static": m.TFMessage,
    "tf": m.TFMessage,
}
"""Topics that are subscribed to, in the order of reading.

Transforms come last: after a pause each datum then finds the transform that was
published before it, though both arrive while the topics are being read.
"""
_TREE = frozenset({"tf_static", "tf"})
_ORDERED = frozenset({"odometry", "scan", "detections_3d", "detections_2d"})
"""Topics whose old messages do not count."""

SILENT_S = 1.0
_CLOCK_OFF_S = 10.0
_BACK_MESSAGES = 5
_PICTURES = 6
_SAME_PICTURE_S = 0.05
_DEPTH_LATE_S = 0.3

_Work = Callable[[Any, Instant], list[Observation]]
"""What follows from a message of a topic."""
PICTURES = ("depth", "mask")
"""Topics of large messages, of which few may be pending."""


def listened(topics: Topics) -> dict[str, tuple[str, type[Message]]]:
    """Topics of a robot: key → full name and type.

    A camera is read only where detections have no depth.
    """
    names = topics.names()
    camera = (*PICTURES, "camera_info") if not topics.detections_2d else ()
    return {
        key: (name, message)
        for key, message in TOPICS.items()
        if (name := names[key]) and key not in camera
    }


@dataclass(frozen=True, slots=True, eq=False)
class _Here:
    """Pose of the robot in ``map`` and in its odometry frame, at a stamp (s)."""

    in_map: RigidTransform
    in_odom: RigidTransform
    odom: str
    stamp: float


@dataclass(slots=True)
class _Stamps:
    """Stamps of one topic: newer ones count, until its clock was set back."""

    newest: float = 0.0
    back: int = 0

    def verdict(self, stamp: float) -> str:
        """``new``, ``same``, ``back``, or ``reset`` when the clock was set back."""
        if stamp > self.newest or stamp == 0.0:
            self.newest, self.back = max(stamp, self.newest), 0
            return "new"
        if stamp == self.newest:
            return "same"
        self.back += 1
        if self.back < _BACK_MESSAGES:
            return "back"
        self.newest, self.back = stamp, 0
        return "reset"


class SensorInputs:
    """Converts ROS messages to observations.

    Args:
        config: Names of topics and frames.
        classes: A detector's class names by number; none: as sent.
        sim_time: Stamps are a simulator's and are not compared with clocks.
    """

    def __init__(
        self,
        config: RobotConfig,
        classes: tuple[str, ...] = (),
        *,
        sim_time: bool = False,
    ) -> None:
        self._names = config.full_topics.names()
        self._frames = config.frames
        self._classes = classes
        self._sim_time = sim_time
        self._grounding = Grounding(p_min=config.p_min)
        self._transforms = TransformBuffer(config.tf_max_age_s)
        self._tf_max_age_s = config.tf_max_age_s
        self._stamps: dict[str, _Stamps] = {}
        self._newest: dict[str, bytes] = {}
        self._heard_at: dict[str, float] = {}
        self._first_heard = float("inf")
        self._began: float | None = None
        self._here: _Here | None = None
        self._depths: deque[m.Image] = deque(maxlen=_PICTURES)
        self._masks: deque[m.Image] = deque(maxlen=_PICTURES)
        self._camera: m.CameraInfo | None = None
        self._look: tuple[m.Detection2DArray, float] | None = None
        self._sent_at: dict[str, float] = {}
        self.input_faults = InputFaults()

    @property
    def place(self) -> RigidTransform | None:
        """Newest pose of the robot in ``map``."""
        return None if self._here is None else self._here.in_map

    # --- messages -----------------------------------------------------------------

    def hear(
        self, topic: str, arrived: Sequence[bytes], now: float, most: int = 0
    ) -> None:
        """Take pending messages of one of ``TOPICS``; ``most`` is its queue depth."""
        self._heard_at[topic] = now
        self._first_heard = min(self._first_heard, now)
        if most and len(arrived) >= most:
            self.input_faults.note("flood", self._name(topic), now)
        if topic in _TREE:
            for one in arrived:
                self._hear_transforms(topic, one, now)
        else:
            self._newest[topic] = arrived[-1]

    def _hear_transforms(self, topic: str, payload: bytes, now: float) -> None:
        message = self._read(topic, payload, now)
        if message is not None:
            self._transforms.add(message, static=topic == "tf_static")

    def tick(self, now: Instant) -> list[Observation]:
        """New observations, odometry first."""
        if self._began is None:
            self._began = now.mono
        self._note_silence(now.mono)
        if self._awaits_transforms(now.mono):
            return []
        found: list[Observation] = []
        works: tuple[tuple[str, _Work], ...] = (
            ("odometry", self._odometry),
            ("scan", self._scan),
            ("detections_3d", self._detections),
            ("depth", self._depth),
            ("mask", self._mask),
            ("camera_info", self._camera_info),
            ("detections_2d", self._picture),
            *((name, partial(self._sensed, name)) for name in ROS_SENSORS),
            ("path", self._path),
        )
        for topic, work in works:
            payload = self._newest.pop(topic, None)
            if payload is not None:
                found += self._attempt(topic, work, payload, now)
        found += self._grounded(now)
        return found

    def _awaits_transforms(self, now: float) -> bool:
        """Whether the first data stay pending, since transforms may follow at once.

        DDS matches the topics of a base one after the other.
        """
        if self._heard_at.keys() >= _TREE:
            return False
        return now - self._first_heard <= self._tf_max_age_s

    def _attempt(
        self,
        topic: str,
        work: _Work,
        payload: bytes,
        now: Instant,
    ) -> list[Observation]:
        """What follows from a message of a topic, unless it is unusable or old."""
        message = self._read(topic, payload, now.mono)
        if message is None:
            return []
        if topic in _ORDERED and not self._is_new(topic, message, now):
            return []
        try:
            return work(message, now)
        except UnreadableError as error:
            self.input_faults.note(error.reason, self._name(topic), now.mono)
            return []

    def _read(self, topic: str, payload: bytes, now: float) -> Any:
        """A message of a topic; None for one that cannot be read."""
        try:
            return cdr.read(TOPICS[topic], payload)
        except UnreadableError:
            self.input_faults.note("unreadable", self._name(topic), now)
            return None

    def _is_new(self, topic: str, message: Any, now: Instant) -> bool:
        """Whether a message counts by its stamp."""
        stamp: float = message.header.stamp.seconds
        verdict = self._stamps.setdefault(topic, _Stamps()).verdict(stamp)
        if verdict in ("back", "reset"):
            self.input_faults.note("time_back", self._name(topic), now.mono)
        if verdict == "reset":
            self._transforms.clear()
            self._here = None
        if not self._sim_time and abs(stamp - now.wall) > _CLOCK_OFF_S:
            self.input_faults.note("clock_off", self._name(topic), now.mono)
        return verdict in ("new", "reset")

    def _name(self, topic: str) -> str:
        return self._names[topic]

    def _note_silence(self, now: float) -> None:
        for topic in ("odometry", "scan"):
            heard = self._heard_at.get(topic)
            # A robot may lack a laser; one whose laser fell silent has a fault.
            since = self._began if heard is None and topic == "odometry" else heard
            if since is not None and now - since > SILENT_S:
                self.input_faults.note("no_data", self._name(topic), now, now - since)

    # --- places -------------------------------------------------------------------

    def _in_map(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        return self._lookup(self._frames.map, frame, stamp, now)

    def _lookup(
        self, outer: str, inner: str, stamp: float, now: float
    ) -> RigidTransform | None:
        """Transform of a frame; None for a missing one, which is noted as a fault."""
        try:
            return self._transforms.lookup(outer, inner.lstrip("/"), stamp)
        except NoTransformError as error:
            self.input_faults.note("no_transform", error.link, now, error.for_s)
            return None

    # --- topics -------------------------------------------------------------------

    def _odometry(self, message: m.Odometry, now: Instant) -> list[Observation]:
        stamp = message.header.stamp.seconds
        twist = reading.read_twist(message.twist.twist)
        odom = message.header.frame_id.lstrip("/") or self._frames.odom
        in_odom = self._base_in_odom(message, stamp, now.mono)
        to_map = self._in_map(odom, stamp, now.mono)
        if in_odom is None or to_map is None:
            self._here = None
            return [Unplaced("", UNKNOWN_ORIGIN, "odometry", twist)]
        place = to_map.compose(in_odom)
        self._here = _Here(place, in_odom, odom, stamp)
        return [Odometry("", UNKNOWN_ORIGIN, place.flat(), twist)]

    def _base_in_odom(
        self, message: m.Odometry, stamp: float, now: float
    ) -> RigidTransform | None:
        pose = reading.read_pose(message)
        child = message.child_frame_id.lstrip("/")
        if child in ("", self._frames.base_link):
            return pose
        base = self._lookup(child, self._frames.base_link, stamp, now)
        return None if base is None else pose.compose(base)

    def _scan(self, message: m.LaserScan, now: Instant) -> list[Observation]:
        stamp = message.header.stamp.seconds
        here = self._here
        late = here is None or abs(stamp - here.stamp) > self._tf_max_age_s
        laser = self._laser(message.header.frame_id, stamp, now.mono)
        if late or laser is None:
            return [Unplaced("", UNKNOWN_ORIGIN, "scan")]
        return [reading.read_scan(message, laser)]

    def _laser(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of the laser relative to the robot's odometry pose."""
        here = self._here
        if here is not None:
            try:
                in_odom = self._transforms.lookup(here.odom, frame.lstrip("/"), stamp)
                return here.in_odom.inverse().compose(in_odom)
            except NoTransformError:
                pass  # odometry may be missing in the tree; the mount must be there
        return self._lookup(self._frames.base_link, frame, stamp, now)

    def _detections(
        self, message: m.Detection3DArray, now: Instant
    ) -> list[Observation]:
        stamp = message.header.stamp.seconds
        found: list[Detection] = []
        places: dict[str, RigidTransform | None] = {}
        lost: list[str | None] = []
        for one in message.detections:
            frame = one.header.frame_id or message.header.frame_id
            if frame not in places:
                places[frame] = self._in_map(frame, stamp, now.mono)
            place = places[frame]
            try:
                if place is None:
                    lost.append(reading.class_id_of(one.results, self._classes))
                else:
                    found.append(reading.read_detection(one, place, self._classes))
            except UnreadableError as error:
                self.input_faults.note(
                    error.reason, self._name("detections_3d"), now.mono
                )
                lost.append(reading.class_id_of(one.results, self._classes))
        return [DetectionFrame("", UNKNOWN_ORIGIN, tuple(found), tuple(lost))]

    def _path(self, message: m.Path, now: Instant) -> list[Observation]:
        frame = message.header.frame_id or self._frames.map
        # A path is old by nature: it is placed by the present transform.
        stamp = self._here.stamp if self._here else message.header.stamp.seconds
        place = self._in_map(frame, stamp, now.mono)
        return [] if place is None else [reading.read_path(message, place)]

    def _sensed(self, name: str, message: Any, now: Instant) -> list[Observation]:
        sensor, sent_at = ROS_SENSORS[name], self._sent_at.get(name, float("-inf"))
        if now.mono - sent_at < sensor.every_s:
            return []
        self._sent_at[name] = now.mono
        return [sensor.read(message)]

    # --- pictures -----------------------------------------------------------------

    def _depth(self, message: m.Image, _: Instant) -> list[Observation]:
        self._depths.append(message)
        return []

    def _mask(self, message: m.Image, _: Instant) -> list[Observation]:
        self._masks.append(message)
        return []

    def _camera_info(self, message: m.CameraInfo, _: Instant) -> list[Observation]:
        self._camera = message
        return []

    def _picture(self, message: m.Detection2DArray, now: Instant) -> list[Observation]:
        self._look = message, now.mono
        return []

    def _grounded(self, now: Instant) -> list[Observation]:
        """The newest detection frame once its depth picture arrived, or is overdue."""
        if self._look is None:
            return []
        look, since = self._look
        depth = pictures.nearest(
            self._depths, look.header.stamp.seconds, _SAME_PICTURE_S
        )
        incomplete = depth is None or self._camera is None
        if incomplete and now.mono - since < _DEPTH_LATE_S:
            return []
        self._look = None
        if not look.detections:
            return [DetectionFrame("", UNKNOWN_ORIGIN, ())]
        frame = None if depth is None else self._located(look, depth, now.mono)
        if incomplete:
            self.input_faults.note("no_depth", self._name("detections_2d"), now.mono)
        lost = (
            reading.class_id_of(one.results, self._classes) for one in look.detections
        )
        return [frame or DetectionFrame("", UNKNOWN_ORIGIN, (), tuple(lost))]

    def _located(
        self, look: m.Detection2DArray, depth: m.Image, now: float
    ) -> DetectionFrame | None:
        """Boxes of a detection frame; None where nothing of it can be located."""
        stamp = look.header.stamp.seconds
        place = self._in_map(depth.header.frame_id, stamp, now)
        if place is None or self._camera is None:
            return None
        mask = pictures.nearest(self._masks, stamp, _SAME_PICTURE_S)
        try:
            picture = pictures.read_depth(depth, self._camera)
            return pictures.grounded(
                look, picture, mask, place, self._classes, self._grounding
            )
        except UnreadableError as error:
            self.input_faults.note(error.reason, self._name("depth"), now)
            return None
