"""Algorithm 1 on a ROS 2 robot: newest message of each topic, transformed to ``map``.

A missing or old transform makes an observation unplaced, and the fault names it; no old
transform is used.  Of all pending messages only the newest is read, so a flood costs no
more than its bytes.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    DetectionFrame,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Unplaced,
)
from iveg.robot.grounding import Grounding
from iveg.robot.ros2 import reading
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.detections import Camera, Places
from iveg.robot.ros2.outputs import Network, Reader
from iveg.robot.ros2.reading import InputFaults, Stamps
from iveg.robot.ros2.topics import ROS_SENSORS, TOPICS, RosSensor, sensed_topics
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from iveg.ros2.messages import STORE, Message
from iveg.ros2.names import Endpoint

# --- subscriptions ----------------------------------------------------------------


class Subscriptions:
    """Topics of a robot's sensors, read in the types in which they are published.

    Readers of all types from the start would show several types of one topic, which
    tools of ROS refuse.

    Args:
        config: Names and qualities of service.
        network: DDS.
        depth: Messages that are kept until they are taken; of transforms always all.
    """

    def __init__(self, config: RobotConfig, network: Network, depth: int = 1) -> None:
        self._config, self._network, self._depth = config, network, depth
        self._topics = sensed_topics(config.full_topics)
        self._readers: dict[str, dict[type[Message], Reader]] = {
            topic: {} for topic in self._topics
        }
        for topic in self._topics:
            for form in TOPICS[topic].forms:
                # Codecs are made before the robot drives, not when a detector joins.
                STORE.get_msgdef(form.ROS)

    def meet(self, endpoints: Sequence[Endpoint]) -> None:
        """Subscribe to the types that others publish by now."""
        for topic, name in self._topics.items():
            qos, readers = self._config.quality(topic), self._readers[topic]
            if TOPICS[topic].role != "transforms":
                qos = qos.newest(self._depth)
            published = {
                end.type for end in endpoints if not end.own and end.writes_to(name)
            }
            for form in TOPICS[topic].forms:
                if form.ROS in published and form not in readers:
                    readers[form] = self._network.reader(name, form, qos)

    def take(self) -> Iterator[tuple[str, type[Message], Sequence[bytes]]]:
        """Waiting messages of each topic, in its type, oldest first."""
        for topic, readers in self._readers.items():
            for form, reader in readers.items():
                if waited := reader.take():
                    yield topic, form, waited


# --- inputs -----------------------------------------------------------------------

SILENT_S = 1.0
_CLOCK_OFF_S = 10.0
_TREE = frozenset({"tf_static", "tf"})


@dataclass(frozen=True, slots=True)
class Sensed:
    """An observation; of a detection frame also the time since its picture (s)."""

    observation: Observation
    age_s: float = 0.0


_Work = Callable[[Any, Instant], Observation | None]
"""Makes an observation of a message of a topic, if there is one."""


class SensorInputs:
    """Converts ROS messages to observations.

    Args:
        config: Names of topics and frames.
        sim_time: Stamps are a simulator's and are not compared with clocks.
    """

    def __init__(
        self,
        config: RobotConfig,
        *,
        sim_time: bool = False,
    ) -> None:
        self.input_faults = faults = InputFaults()
        self._names, self._map = config.full_topics, config.frames.map
        self._sim_time = sim_time
        self._tf_max_age_s = config.transforms.max_age_s
        self._places = Places(config.frames, config.transforms.max_age_s, faults)
        grounding = Grounding(p_min=config.detector.p_min)
        self._camera = Camera(self._names, grounding, self._places, faults)
        self._stamps: defaultdict[str, Stamps] = defaultdict(Stamps)
        self._newest: dict[str, tuple[type[Message], bytes]] = {}
        self._used_at: dict[str, float] = {}
        self._first_at = math.inf
        self._began: float | None = None
        self._sent_at: dict[str, float] = {}
        self._works: dict[str, _Work] = {
            "odometry": self._odometry,
            "scan": self._scan,
            "detections_3d": self._detections,
            "depth": self._camera.add_depth,
            "mask": self._camera.add_mask,
            "camera_info": self._camera.set_info,
            "detections_2d": self._camera.replace_look,
            **{
                name: partial(self._sensed, name, sensor)
                for name, sensor in ROS_SENSORS.items()
            },
            "path": self._path,
        }

    def pose(self) -> Pose2D | None:
        """Newest pose of the robot in ``map``; None while it is not localised."""
        here = self._places.here
        return None if here is None else here.in_map.flat()

    # --- messages -----------------------------------------------------------------

    def receive(
        self,
        topic: str,
        arrived: Sequence[bytes],
        now: float,
        form: type[Message] | None = None,
    ) -> None:
        """Note pending messages of a topic that is read.

        Args:
            topic: Its key.
            arrived: At least one, oldest first.
            now: Monotonic (s).
            form: Their type, where the topic may have several.
        """
        message = form or TOPICS[topic].message
        self._first_at = min(self._first_at, now)
        if topic not in _TREE:
            self._newest[topic] = message, arrived[-1]
            return
        for payload in arrived:
            try:
                links = cdr.read(message, payload)
            except UnreadableError as error:
                self._note(error.reason, topic, now)
            else:
                self._places.add(links, static=topic == "tf_static")

    def tick(self, now: Instant) -> list[Sensed]:
        """New observations, odometry first."""
        if self._began is None:
            self._began = now.mono + self._tf_max_age_s
        self._note_silence(self._began, now.mono)
        # DDS matches the topics of a base one after the other, and each node publishes
        # its own link of the chain: the first data wait for the transforms that follow.
        if now.mono - self._first_at <= self._tf_max_age_s:
            return []
        sensed = [
            self._attempt(topic, work, *newest, now)
            for topic, work in self._works.items()
            if (newest := self._newest.pop(topic, None)) is not None
        ]
        if (located := self._camera.locate(now.mono)) is not None:
            frame, stamp = located
            sensed.append(Sensed(frame, self._age_s("detections_2d", stamp, now)))
        return [present for present in sensed if present is not None]

    def _note_silence(self, began: float, now: float) -> None:
        # A robot may lack a laser, but a laser that has worked must go on.
        for topic, start in (("odometry", began), ("scan", math.inf)):
            silent = now - self._used_at.get(topic, start)
            if silent > SILENT_S:
                self._note("no_data", topic, now, silent)

    def _attempt(
        self,
        topic: str,
        work: _Work,
        form: type[Message],
        payload: bytes,
        now: Instant,
    ) -> Sensed | None:
        """The observation of a message; None where it is unusable or old."""
        try:
            message = cdr.read(form, payload)
            is_stream = TOPICS[topic].role == "stream"
            stamp = message.header.stamp.seconds if is_stream else None
            if stamp is not None and not self._is_new(topic, stamp, now):
                return None
            observation = work(message, now)
        except UnreadableError as error:
            self._note(error.reason, topic, now.mono)
            return None
        self._used_at[topic] = now.mono
        age_s = 0.0 if stamp is None else self._age_s(topic, stamp, now)
        if isinstance(observation, DetectionFrame):
            return Sensed(observation, age_s)
        # A wrong stamp of a pose would hide motion from a standstill (I3).
        return None if observation is None else Sensed(observation)

    def _age_s(self, topic: str, stamp: float, now: Instant) -> float:
        """Time since a stamp (s), at most ten; a late topic is a fault."""
        present = self._stamps["odometry"].newest if self._sim_time else now.wall
        age_s = min(max(0.0, present - stamp), _CLOCK_OFF_S)
        if age_s > SILENT_S:
            self._note("data_late", topic, now.mono)
        return age_s

    def _is_new(self, topic: str, stamp: float, now: Instant) -> bool:
        """Whether a message counts by its stamp."""
        verdict = self._stamps[topic].verdict(stamp)
        if verdict in ("back", "reset"):
            self._note("time_back", topic, now.mono)
        if verdict == "reset":
            self._places.forget()
        if not self._sim_time and abs(stamp - now.wall) > _CLOCK_OFF_S:
            self._note("clock_off", topic, now.mono)
        return verdict in ("new", "reset")

    def _note(
        self, code: str, topic: str, now: float, for_s: float | None = None
    ) -> None:
        self.input_faults.note(code, self._names[topic], now, for_s)

    # --- topics -------------------------------------------------------------------

    def _odometry(self, message: ros.Odometry, now: Instant) -> Odometry | Unplaced:
        twist = reading.read_twist(message.twist.twist)
        place = self._places.locate(message, now.mono)
        if place is None:
            return Unplaced("", UNKNOWN_ORIGIN, "odometry", twist)
        return Odometry("", UNKNOWN_ORIGIN, place.flat(), twist)

    def _scan(self, message: ros.LaserScan, now: Instant) -> LaserScan | Unplaced:
        header = message.header
        laser = self._places.laser(header.frame_id, header.stamp.seconds, now.mono)
        if laser is None:
            return Unplaced("", UNKNOWN_ORIGIN, "scan")
        return reading.read_scan(message, laser)

    def _detections(self, message: Message, now: Instant) -> DetectionFrame:
        topic = self._names["detections_3d"]
        return self._places.detections(message, topic, now.mono)

    def _path(self, message: ros.Path, now: Instant) -> Navigation | None:
        frame, here = message.header.frame_id or self._map, self._places.here
        # A path is old by nature: it is placed by the present transform.
        stamp = here.stamp if here else message.header.stamp.seconds
        place = self._places.in_map(frame, stamp, now.mono)
        return None if place is None else reading.read_path(message, place)

    def _sensed(
        self, name: str, sensor: RosSensor, message: Message, now: Instant
    ) -> Observation | None:
        if now.mono - self._sent_at.get(name, -math.inf) < sensor.every_s:
            return None
        self._sent_at[name] = now.mono
        return sensor.read(message)
