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
    LaserScan,
    Odometry,
)
from iveg.robot.replay.logs import RecordingEntry
from iveg.robot.ros2.config import Frames
from iveg.robot.ros2.detections import Boxes, Places
from iveg.robot.ros2.reading import InputFaults, read_scan, read_twist
from iveg.robot.ros2.topics import BOXES
from iveg.robot.ros2.transforms import IDENTITY, TransformBuffer
from iveg.ros2 import cdr
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.cdr import type_hash
from iveg.ros2.messages import Message

# --- which topics are read, and as what -----------------------------------------------

_log = logging.getLogger(__name__)
NamedTopics = Mapping[str, str | None]
"""Topic to read by its role; None, or no role: the only one of its types."""
_CHOSEN: Mapping[str, tuple[str, Sequence[type[Message]]]] = {
    "odometry": ("--odom-topic", (ros.Odometry,)),
    "scan": ("--scan-topic", (ros.LaserScan,)),
    "detections": ("--detections-topic", tuple(BOXES)),
}
"""Option of the command that names the topic of a role, and its types."""
_FORMS = (ros.TFMessage, *(form for _, forms in _CHOSEN.values() for form in forms))


@dataclass(frozen=True, slots=True)
class BagTopic:
    """One topic of a bag, in one type; the hash is empty where none was written."""

    name: str
    type: str
    type_hash: str


@dataclass(frozen=True, slots=True)
class Use:
    """A topic with its role and the type it is read in."""

    topic: BagTopic
    role: str
    form: type[Message]


def uses_of(
    path: Path, topics: Sequence[BagTopic], named: NamedTopics
) -> dict[str, Use]:
    """Topics of a bag that are read, by name.

    Args:
        path: The bag, for complaints.
        topics: All that it holds.
        named: Topics that are named.

    Raises:
        DataFileError: its topics leave open which is meant, or none is odometry.
    """
    uses: dict[str, Use] = {}
    for topic, role in _roles(path, topics, named):
        form = next(form for form in _FORMS if topic.type == form.ROS)
        if topic.type_hash in ("", type_hash(form)):
            uses[topic.name] = Use(topic, role, form)
        else:
            why = "its type is of another definition"
            _log.warning("%s, %s is not read: %s", path, topic.name, why)
    if not any(use.role == "odometry" for use in uses.values()):
        raise _unusable(path, f"holds no topic of type {ros.Odometry.ROS}")
    return uses


def _roles(
    path: Path, topics: Sequence[BagTopic], named: NamedTopics
) -> Iterator[tuple[BagTopic, str]]:
    """Each topic that is needed, and its role."""
    for role in _CHOSEN:
        for topic in _chosen(path, topics, role, named.get(role)):
            yield topic, role
    for topic in topics:
        if topic.type == ros.TFMessage.ROS:
            is_static = topic.name.endswith("tf_static")
            yield topic, "tf_static" if is_static else "tf"


def _chosen(
    path: Path, topics: Sequence[BagTopic], role: str, wanted: str | None
) -> Sequence[BagTopic]:
    """The topic of a role, if there is one.

    Raises:
        DataFileError: several, or the one that is named is not there.
    """
    option, forms = _CHOSEN[role]
    types = [form.ROS for form in forms]
    found = [topic for topic in topics if topic.type in types]
    chosen = [topic for topic in found if wanted in (None, topic.name)]
    if len(chosen) > 1 or (wanted is not None and not chosen):
        names = ", ".join(sorted({topic.name for topic in found})) or "none"
        those = f"those of {' or '.join(types)}: {names}"
        raise _unusable(path, f"{option} must name one of {those}")
    return chosen


def _unusable(path: Path, reason: str) -> DataFileError:
    """The error that a bag cannot be used; ``reason`` without its full stop."""
    return DataFileError(str(path), "", f"{reason}.")


# --- bag pass ---------------------------------------------------------------------
#
# One pass over a bag: its messages as observations in ``map``, as on a live robot.
#
# What a bag leaves out is stood in for: without ``map`` the root of its odometry is
# ``map``; without the frame of its laser the laser sits where the fleet file says.

_MAX_AGE_S = 1.0
"""Greatest age of a transform (s); maps are corrected less often in recordings."""
BagObservation = Odometry | LaserScan | DetectionFrame


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
        self._works: dict[str, Callable[[Any, float], BagObservation | None]] = {
            "odometry": self._odometry,
            "scan": self._scan,
            "detections": self._detections,
            "tf": lambda message, _: self._places.add(message, static=False),
            "tf_static": lambda message, _: self._places.add(message, static=True),
        }

    def observe(self, use: Use, message: object, now: float) -> BagObservation | None:
        """The observation of one message; ``now`` is when it was written (s).

        Raises:
            UnreadableError: values out of range, or nobody knows where it was.
        """
        self._lost.clear()
        found = self._works[use.role](message, now)
        if found is None and use.role in _CHOSEN:
            faults = self._lost.faults(now)
            why = "; ".join(f"{fault.code}, {fault.about}" for fault in faults)
            raise UnreadableError("unplaced", why)
        return found

    def _odometry(self, message: ros.Odometry, now: float) -> Odometry | None:
        place = self._places.locate(message, now)
        if place is None:
            return None
        twist = read_twist(message.twist.twist)
        return Odometry("", UNKNOWN_ORIGIN, place.flat(), twist)

    def _scan(self, message: ros.LaserScan, now: float) -> LaserScan | None:
        frame, stamp = message.header.frame_id, message.header.stamp.seconds
        if not self._tree.has_mount(frame):
            return replace(read_scan(message, IDENTITY), mount=self._mount)
        mount = self._places.on_robot(frame, stamp, now)
        return None if mount is None else read_scan(message, mount)

    def _detections(self, message: Message, now: float) -> DetectionFrame:
        if isinstance(message, d.DetectionArray):
            seen = message.detections
            if seen and not any(box.bbox3d.frame_id for box in seen):
                raise UnreadableError("no_depth", "boxes in a picture")
        return self._boxes.locate(message, now)


class BagTree:
    """Frames of a bag, as far as its beginning tells.

    Args:
        static: All static messages.
        moving: The first of the others.
        odometry: The first odometry; None without.

    Attributes:
        frames: Names of the robot's frames in the bag.
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
        self.links = [*static]
        if usual.map not in self._up(odom):
            header = ros.Header(frame_id=usual.map)
            root = ros.TransformStamped(header, self._up(odom)[-1])
            self.links.append(ros.TFMessage((root,)))

    def has_mount(self, frame: str) -> bool:
        """Whether the bag tells where a frame is on the robot."""
        return self.frames.base_link in self._up(frame.lstrip("/"))[1:]


# --- bags -------------------------------------------------------------------------

_LONGEST_S = 1e7
_LINKS_AHEAD = 2000
"""Messages of TF that tell, before the first pass, which frames there are."""


class Bag:
    """One recording of ROS, read from its start as often as asked, never held whole.

    Args:
        path: A file ``.db3`` or ``.mcap``, or a directory.
        named: Topics that are named.
        mount: The laser's pose in ``base_link``, unless the bag has it.

    Raises:
        DataFileError: it cannot be read, or its topics leave open which is meant.
    """

    def __init__(self, path: Path, named: NamedTopics, mount: Pose2D) -> None:
        self._path, self._mount = path, mount
        self._uses = uses_of(path, _topics_of(path), named)
        self._reported: set[str] = set()
        static = [*self._messages("tf_static")]
        moving = [*islice(self._messages("tf"), _LINKS_AHEAD)]
        self._tree = BagTree(static, moving, next(self._messages("odometry"), None))
        # Stamps count unless the first message has none: a bag uses one of the two
        # clocks throughout, since they may differ by years.
        first = next(self._messages(*_CHOSEN), None)
        self._has_stamps = first is None or first.header.stamp.seconds > 0.0

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries, in the order in which they were recorded.

        A message that cannot be used is skipped; the first of a topic is reported, and
        one with an absurd stamp is omitted.

        Raises:
            DataFileError: the recording breaks off.
        """
        this = BagPass(self._uses, self._tree, self._mount)
        start: float | None = None
        for use, logged_s, payload in self._records():
            try:
                message: Any = cdr.read(use.form, payload)
                found = this.observe(use, message, logged_s)
            except UnreadableError as error:
                self._report(use, logged_s, str(error))
                continue
            if found is None:
                continue
            at = message.header.stamp.seconds if self._has_stamps else logged_s
            start = at if start is None else start
            if abs(at - start) <= _LONGEST_S:
                yield RecordingEntry(at - start, found)

    def _records(self, *roles: str) -> Iterator[tuple[Use, float, bytes]]:
        """Messages with these roles, or all that are read; when written (Unix s)."""
        uses = {
            (name, use.topic.type): use
            for name, use in self._uses.items()
            if not roles or use.role in roles
        }
        with _open(self._path) as reader:
            connections = [
                found
                for found in reader.connections
                if (found.topic, found.msgtype) in uses
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
    with _open(path) as reader:
        found = {
            (source.topic, source.msgtype, _type_hash_in(source.digest))
            for source in reader.connections
        }
    return [BagTopic(*each) for each in sorted(found)]


def _type_hash_in(digest: str) -> str:
    return digest if digest.startswith("RIHS01_") else ""


@contextmanager
def _open(path: Path) -> Iterator[Reader]:
    try:
        with Reader(path) as reader:
            yield reader
    except Exception as error:  # whatever a foreign or damaged file provokes
        said = " ".join(str(error).split()) or type(error).__name__
        raise _unusable(path, f"cannot be read: {said.rstrip('.')}") from error
