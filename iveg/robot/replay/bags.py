"""ROS bags: odometry, scans and detections of recordings, placed by their TF."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader

from iveg.domain.errors import DataFileError, UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    DetectionFrame,
    Instant,
    LaserScan,
    Odometry,
)
from iveg.robot.grounding import DEFAULT as GROUNDING
from iveg.robot.replay.logs import RecordingEntry
from iveg.robot.ros2.config import Frames
from iveg.robot.ros2.detections import Boxes, Camera, Places
from iveg.robot.ros2.reading import InputFaults, read_scan, read_twist
from iveg.robot.ros2.topics import BOXES, LOOKS
from iveg.robot.ros2.transforms import IDENTITY, TransformBuffer
from iveg.ros2 import cdr
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.cdr import type_hash
from iveg.ros2.messages import Message, definitions

# --- which topics are read, and as what -----------------------------------------------

DETECTORS: tuple[type[Message], ...] = tuple(dict.fromkeys((*BOXES, *LOOKS)))
_Forms = Sequence[type[Message]]
_PREFERRED: tuple[_Forms, ...] = (
    tuple(one for one in BOXES if one not in LOOKS),
    tuple(one for one in BOXES if one in LOOKS),
    tuple(one for one in LOOKS if one not in BOXES),
)
"""Detectors of one row exclude each other."""
_FORMS: tuple[type[Message], ...] = (
    ros.Odometry,
    ros.LaserScan,
    ros.TFMessage,
    ros.Image,
    ros.CameraInfo,
    *DETECTORS,
)


@dataclass(frozen=True, slots=True)
class BagOptions:
    """Choices for reading a bag.

    Attributes:
        odometry: Topic to read; None takes the only one of its type; ``scan`` likewise.
        detections: Likewise, boxes with depth before those without.
        depth: Depth picture for boxes without; None takes the only picture whose
            topic names depth.
        camera_info: Of the depth picture; None takes the one beside it.
        bag_time: A bag is timed by its recording times, not by sensor stamps.
    """

    odometry: str | None = None
    scan: str | None = None
    bag_time: bool = False
    detections: str | None = None
    depth: str | None = None
    camera_info: str | None = None


AS_RECORDED = BagOptions()
"""The only topic of each type, by sensor stamps."""


@dataclass(frozen=True, slots=True)
class BagTopic:
    """One topic of a bag, in one type; the hash is empty where none was written."""

    name: str
    type: str
    count: int
    type_hash: str


@dataclass(frozen=True, slots=True)
class Use:
    """A topic with its role and the type it is read in."""

    topic: BagTopic
    role: str
    form: type[Message]


class BagPlan:
    """Uses of all topics of a bag.

    Args:
        path: The bag, for complaints.
        topics: All that it holds.
        options: Topics that are named.

    Raises:
        DataFileError: its topics leave open which is meant.
    """

    def __init__(
        self, path: Path, topics: Sequence[BagTopic], options: BagOptions
    ) -> None:
        self._path, self._topics = path, topics
        self.read: dict[str, Use] = {}
        self._fates: dict[BagTopic, str] = {}
        self._choose("odometry", (ros.Odometry,), options.odometry, "--odom-topic")
        self._choose("scan", (ros.LaserScan,), options.scan, "--scan-topic")
        for one in self._named((ros.TFMessage,)):
            self._use(one, "tf_static" if one.name.endswith("tf_static") else "tf")
        self._choose_detector(options)

    def has(self, *roles: str) -> bool:
        """Whether a topic is read as one of these."""
        return any(use.role in roles for use in self.read.values())

    def table(self) -> list[str]:
        """One line a topic: name, type, messages, and what becomes of it."""
        rows = [
            (one.name, one.type, str(one.count), self._fates.get(one, _NOT_NEEDED))
            for one in self._topics
        ]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]

    def _choose(
        self, role: str, forms: _Forms, wanted: str | None, option: str
    ) -> Use | None:
        """Choose the topic of a role; None where there is none.

        Raises:
            DataFileError: several, or the named one is not there.
        """
        chosen = self._named(forms, wanted, option)
        if len(chosen) > 1:
            those = _those(forms, chosen)
            raise _unusable(self._path, f"{option} must name one of {those}")
        return self._use(chosen[0], role) if chosen else None

    def _named(
        self, forms: _Forms, wanted: str | None = None, option: str = ""
    ) -> list[BagTopic]:
        """Topics of these types, or the one that is named.

        Raises:
            DataFileError: that one is not there.
        """
        kinds = {one.ROS for one in forms}
        found = [one for one in self._topics if one.type in kinds]
        named = [one for one in found if wanted in (None, one.name)]
        if wanted is not None and not named:
            those = _those(forms, found)
            raise _unusable(self._path, f"{option} {wanted} is not among {those}")
        return named

    def _use(self, topic: BagTopic, role: str) -> Use | None:
        """Read a topic, unless its type has other fields under the same name."""
        form = next(one for one in _FORMS if topic.type == one.ROS)
        if topic.type_hash not in ("", *map(type_hash, definitions(form))):
            self._fates[topic] = f"ignored: another definition, {topic.type_hash}"
            return None
        use = self.read.setdefault(topic.name, Use(topic, role, form))
        self._fates.setdefault(use.topic, use.role)
        return use

    def _choose_detector(self, options: BagOptions) -> None:
        """Boxes with depth first; those without need a depth picture and its camera."""
        wanted, option = options.detections, "--detections-topic"
        kinds = _PREFERRED if wanted is None else (DETECTORS,)
        choices = (self._choose("detections", one, wanted, option) for one in kinds)
        chosen = next((one for one in choices if one is not None), None)
        if chosen is None or chosen.form not in LOOKS or self._take_depth(options):
            return
        if chosen.form not in BOXES:
            del self.read[chosen.topic.name]
            self._fates[chosen.topic] = (
                "ignored: boxes in a picture; no --depth-topic with its "
                "--camera-info-topic"
            )

    def _take_depth(self, options: BagOptions) -> bool:
        """Take the depth picture and its camera; whether both are there."""
        depth = [
            one
            for one in self._named((ros.Image,), options.depth, "--depth-topic")
            if options.depth or "depth" in one.name.lower()
        ]
        wanted, option = options.camera_info, "--camera-info-topic"
        cameras = self._named((ros.CameraInfo,), wanted, option)
        if len(depth) != 1:
            return False
        beside = f"{depth[0].name.rpartition('/')[0]}/camera_info"
        info = [one for one in cameras if one.name == beside] or cameras
        if len(info) != 1:
            return False
        taken = self._use(depth[0], "depth"), self._use(info[0], "camera_info")
        return None not in taken


_NOT_NEEDED = "ignored: not needed"


def _those(forms: _Forms, topics: Sequence[BagTopic]) -> str:
    names = ", ".join(sorted({one.name for one in topics})) or "none"
    return f"those of {' or '.join(one.ROS for one in forms)}: {names}"


def _unusable(path: Path, reason: str) -> DataFileError:
    """The error that a bag cannot be used; ``reason`` without its full stop."""
    return DataFileError(str(path), "", f"{reason}.")


# --- bag pass ---------------------------------------------------------------------
#
# One pass over a bag: its messages as observations in ``map``, as on a live robot.
#
# What a bag leaves out is stood in for: without ``map`` the root of its odometry is
# ``map``; without odometry among its transforms the odometry itself leads to the robot;
# without the frame of its laser the laser sits where the fleet file says.

_MAX_AGE_S = 1.0
"""Greatest age of a transform (s); maps are corrected less often in recordings."""
BagObservation = Odometry | LaserScan | DetectionFrame
_UNPLACED = "boxes without depth"
_OWN = "odometry", "scan"
"""Each message gives an observation of its own."""


class BagPass:
    """State of one pass.

    Args:
        uses: Topics that are read, by name.
        tree: Links of the bag that are known before its first message.
        mount: The laser's pose in ``base_link``, unless the bag has it.
    """

    def __init__(self, uses: Mapping[str, Use], tree: "BagTree", mount: Pose2D) -> None:
        self._mount, self._tree = mount, tree
        self._lost = InputFaults()
        """Faults of the newest message alone."""
        self._places = Places(tree.frames, _MAX_AGE_S, self._lost)
        for links in tree.links:
            self._places.add(links, static=True)
        names = {use.role: name for name, use in uses.items()}
        seen = names.get("detections", "")
        self._boxes = Boxes(seen, self._places, self._lost)
        called = {"detections_2d": seen, "depth": names.get("depth", "")}
        self._camera = Camera(called, GROUNDING, self._places, self._lost)
        self._works: dict[str, Callable[[Any, Instant], BagObservation | None]] = {
            "odometry": self._odometry,
            "scan": self._scan,
            "detections": self._detections,
            "depth": self._camera.add_depth,
            "camera_info": self._camera.set_info,
            "tf": lambda one, _: self._places.add(one, static=False),
            "tf_static": lambda one, _: self._places.add(one, static=True),
        }

    def observe(self, use: Use, message: object, now: float) -> BagObservation | None:
        """The observation of one message; ``now`` is when it was written (s).

        Raises:
            UnreadableError: values out of range.
        """
        self._lost.clear()
        return self._works[use.role](message, Instant(now, now))

    def late_frame(self, now: float) -> DetectionFrame | None:
        """The detection frame that has waited for its depth picture."""
        return self._camera.locate(now)

    def why_lost(self, use: Use, found: BagObservation | None, now: float) -> str:
        """Why a message gave no observation, or a box no place; else empty."""
        unplaced = isinstance(found, DetectionFrame) and found.unread
        if not unplaced and (found is not None or use.role not in _OWN):
            return ""
        reasons = [f"{one.code}, {one.about}" for one in self._lost.faults(now)]
        return reasons[0] if reasons else _UNPLACED

    def _odometry(self, message: ros.Odometry, now: Instant) -> Odometry | None:
        if self._tree.lacks_base:
            self._places.add(_link(message), static=False)
        place = self._places.locate(message, now.mono)
        if place is None:
            return None
        twist = read_twist(message.twist.twist)
        return Odometry("", UNKNOWN_ORIGIN, place.flat(), twist)

    def _scan(self, message: ros.LaserScan, now: Instant) -> LaserScan | None:
        frame, stamp = message.header.frame_id, message.header.stamp.seconds
        if not self._tree.has_mount(frame):
            return replace(read_scan(message, IDENTITY), mount=self._mount)
        mount = self._places.on_robot(frame, stamp, now.mono)
        return None if mount is None else read_scan(message, mount)

    def _detections(self, message: Message, now: Instant) -> DetectionFrame | None:
        is_3d = type(message) in BOXES and type(message) not in LOOKS
        if isinstance(message, d.DetectionArray):
            is_3d = any(one.bbox3d.frame_id for one in message.detections)
        if is_3d:
            return self._boxes.locate(message, now.mono)
        self._camera.replace_look(message, now)
        return None


class BagTree:
    """Frames of a bag, as far as its beginning tells.

    Args:
        static: All static messages.
        moving: The first of the others.
        odometry: The first odometry; None without.

    Attributes:
        frames: Names of the robot's frames in the bag.
        lacks_base: Odometry must stand in for its own transform.
        links: What is known before the first message.
    """

    def __init__(
        self,
        static: Sequence[ros.TFMessage],
        moving: Sequence[ros.TFMessage],
        odometry: ros.Odometry | None,
    ) -> None:
        known = TransformBuffer()
        for message in (*static, *moving):
            known.add(message, static=True)
        self._up, usual, odom, base = known.chain, Frames(), "", ""
        if odometry is not None:
            odom = odometry.header.frame_id.lstrip("/")
            base = odometry.child_frame_id.lstrip("/")
        odom, base = odom or usual.odom, base or usual.base_link
        if usual.base_link in self._up(base) or base in self._up(usual.base_link):
            base = usual.base_link  # odometry of a footprint
        self.frames = usual.model_copy(update={"odom": odom, "base_link": base})
        self.lacks_base = not {odom, usual.map} & set(self._up(base))
        self.links = [*static]
        if usual.map not in self._up(odom):
            header = ros.Header(frame_id=usual.map)
            root = ros.TransformStamped(header, self._up(odom)[-1])
            self.links.append(ros.TFMessage((root,)))

    def has_mount(self, frame: str) -> bool:
        """Whether the bag tells where a frame is on the robot."""
        return self.frames.base_link in self._up(frame.lstrip("/"))[1:]


def _link(odometry: ros.Odometry) -> ros.TFMessage:
    """Odometry as a transform."""
    place, turned = odometry.pose.pose.position, odometry.pose.pose.orientation
    transform = ros.Transform(ros.Vector3(place.x, place.y, place.z), turned)
    child = odometry.child_frame_id or Frames().base_link
    one = ros.TransformStamped(odometry.header, child, transform)
    return ros.TFMessage((one,))


# --- bags -------------------------------------------------------------------------

_log = logging.getLogger(__name__)
_LONGEST_S = 1e7
_LINKS_AHEAD = 2000
"""Messages of TF that tell, before the first pass, which frames there are."""
_STAMPED = "odometry", "scan", "detections"


class Bag:
    """One recording of ROS, read from its start as often as asked, never held whole.

    Args:
        path: A file ``.db3`` or ``.mcap``, or a directory.
        options: Topics and clock.
        mount: The laser's pose in ``base_link``, unless the bag has it.
        needs_odometry: Whether a bag without it is refused.

    Raises:
        DataFileError: it cannot be read, or its topics leave open which is meant.
    """

    def __init__(
        self, path: Path, options: BagOptions, mount: Pose2D, *, needs_odometry: bool
    ) -> None:
        self._path, self._mount = path, mount
        self.plan = plan = BagPlan(path, _topics_of(path), options)
        if not plan.has("odometry") and (
            needs_odometry or not plan.has("scan", "detections")
        ):
            raise _unusable(path, f"holds no topic of type {ros.Odometry.ROS}")
        self._reported: set[str] = set()
        static = [*self._messages("tf_static")]
        moving = [*islice(self._messages("tf"), _LINKS_AHEAD)]
        self._tree = BagTree(static, moving, next(self._messages("odometry"), None))
        # Stamps count unless the first message has none: a bag uses one of the two
        # clocks throughout, since they may differ by years.
        first = next(self._messages(*_STAMPED), None)
        has_stamps = first is None or first.header.stamp.seconds > 0.0
        self._bag_time = options.bag_time or not has_stamps

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries, in the order in which they were recorded.

        A message that cannot be used is skipped; the first of a topic is reported, and
        one with an absurd stamp is omitted.

        Raises:
            DataFileError: the recording breaks off.
        """
        this = BagPass(self.plan.read, self._tree, self._mount)
        start: float | None = None
        look_at = 0.0
        for use, logged_s, payload in self._records():
            try:
                message = cdr.read(use.form, payload)
                found = this.observe(use, message, logged_s)
            except UnreadableError as error:
                self._report(use, logged_s, str(error))
                continue
            header = getattr(message, "header", None)
            at = logged_s if self._bag_time or not header else header.stamp.seconds
            if use.role in _STAMPED:
                start = at if start is None else start
            if use.role == "detections":
                look_at = at
            if found is None:
                found, at = this.late_frame(logged_s), look_at
            if why := this.why_lost(use, found, logged_s):
                self._report(use, logged_s, why)
            if found is None or start is None or abs(at - start) > _LONGEST_S:
                continue
            yield RecordingEntry(at - start, found)

    def _records(self, *roles: str) -> Iterator[tuple[Use, float, bytes]]:
        """Messages with these roles, or all that are read; when written (Unix s)."""
        uses = {
            (name, use.topic.type): use
            for name, use in self.plan.read.items()
            if not roles or use.role in roles
        }
        with _open(self._path) as reader:
            connections = [
                one for one in reader.connections if (one.topic, one.msgtype) in uses
            ]
            records = reader.messages(connections=connections) if connections else ()
            for source, logged, data in records:
                yield uses[source.topic, source.msgtype], logged / 1e9, bytes(data)

    def _messages(self, *roles: str) -> Iterator[Any]:
        """Those of them that can be read."""
        for use, _, payload in self._records(*roles):
            with suppress(UnreadableError):
                yield cdr.read(use.form, payload)

    def _report(self, use: Use, logged_s: float, why: str) -> None:
        topic = use.topic.name
        if topic not in self._reported:
            self._reported.add(topic)
            _log.warning(
                "%s, %s: unusable messages are skipped, such as at %d ns: %s",
                self._path,
                topic,
                round(logged_s * 1e9),
                why,
            )


def _topics_of(path: Path) -> list[BagTopic]:
    """Topics of a bag by name; several recorded connections of one are joined."""
    counts: dict[tuple[str, str, str], int] = {}
    with _open(path) as reader:
        for one in reader.connections:
            digest = one.digest if one.digest.startswith("RIHS01_") else ""
            key = one.topic, one.msgtype, digest
            counts[key] = counts.get(key, 0) + one.msgcount
    return [
        BagTopic(name, kind, counts[name, kind, digest], digest)
        for name, kind, digest in sorted(counts)
    ]


@contextmanager
def _open(path: Path) -> Iterator[Reader]:
    try:
        with Reader(path) as reader:
            yield reader
    except Exception as error:  # whatever a foreign or damaged file provokes
        said = " ".join(str(error).split()) or type(error).__name__
        raise _unusable(path, f"cannot be read: {said.rstrip('.')}") from error
