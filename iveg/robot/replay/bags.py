"""ROS bags: odometry, scans and detections of recordings, placed by their TF."""

import logging
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader

from iveg.domain.errors import DataFileError, UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    DetectionFrame,
    LaserScan,
    Odometry,
)
from iveg.robot.replay.logs import Played, RecordingEntry
from iveg.robot.ros2.config import Frames
from iveg.robot.ros2.detections import Places
from iveg.robot.ros2.reading import InputFaults, read_scan, read_twist
from iveg.robot.ros2.topics import BOXES
from iveg.robot.ros2.transforms import IDENTITY, TransformBuffer
from iveg.ros2 import cdr
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.cdr import type_hash
from iveg.ros2.messages import Message

# --- topics and their roles -----------------------------------------------------------

_log = logging.getLogger(__name__)
NamedTopics = Mapping[str, str | None]
"""Topic to read by its role; None, or no role: the only one of its types."""
_CHOSEN: Mapping[str, tuple[str, Sequence[type[Message]]]] = {
    "odometry": ("--odom-topic", (ros.Odometry,)),
    "scan": ("--scan-topic", (ros.LaserScan,)),
    "detections": ("--detections-topic", tuple(BOXES)),
}
"""Option of the command that names the topic of a role, and its types."""
_FORMS = {
    form.ROS: form
    for form in (
        ros.TFMessage,
        *(form for _, forms in _CHOSEN.values() for form in forms),
    )
}
"""Type of each message that is read, by its ROS name."""
Topic = tuple[str, str]
"""Name, and ROS name of its type."""


def roles_of(
    path: Path, topics: Collection[Topic], named: NamedTopics
) -> dict[Topic, str]:
    """Role of each topic of a bag that is read.

    Args:
        path: The bag, for complaints.
        topics: All that it holds.
        named: Topics to read, by role.

    Raises:
        DataFileError: several topics fit a role, or none is odometry.
    """
    roles = {
        (name, kind): "tf_static" if name.endswith("tf_static") else "tf"
        for name, kind in topics
        if kind == ros.TFMessage.ROS
    }
    for role, (option, forms) in _CHOSEN.items():
        types, wanted = [form.ROS for form in forms], named.get(role)
        fitting = [(name, kind) for name, kind in topics if kind in types]
        matching = [topic for topic in fitting if wanted in (None, topic[0])]
        if len(matching) > 1 or (wanted is not None and not matching):
            names = ", ".join(sorted({name for name, _ in fitting})) or "none"
            candidates = f"those of {' or '.join(types)}: {names}"
            raise _unusable(path, f"{option} must name one of {candidates}")
        roles |= dict.fromkeys(matching, role)
    if "odometry" not in roles.values():
        raise _unusable(path, f"holds no topic of type {ros.Odometry.ROS}")
    return roles


def _is_readable(path: Path, connection: Connection) -> bool:
    """Whether the type of a topic is read, in the same definition."""
    form, digest = _FORMS.get(connection.msgtype), connection.digest
    if form is None:
        return False
    if digest.startswith("RIHS01_") and digest != type_hash(form):
        reason = "its type is of another definition"
        _log.warning("%s, %s is not read: %s", path, connection.topic, reason)
        return False
    return True


def _unusable(path: Path, reason: str) -> DataFileError:
    """The error that a bag cannot be used; ``reason`` without its full stop."""
    return DataFileError(str(path), "", f"{reason}.")


# --- bag pass ---------------------------------------------------------------------
#
# One pass over a bag: its messages as observations in ``map``, as on a live robot.
#
# Defaults replace what a bag lacks: without ``map`` the root of its odometry is
# ``map``; without the frame of its laser the laser sits where the fleet file says.

_MAX_AGE_S = 1.0
"""Greatest age of a transform (s); maps are corrected less often in recordings."""


class BagPass:
    """State of one pass.

    Args:
        tree: Links of the bag that are known before its first message.
        mount: The laser's pose in ``base_link``, unless the bag has it.
    """

    def __init__(self, tree: "BagTree", mount: Pose2D) -> None:
        self._mount, self._tree = mount, tree
        self._lost = InputFaults()
        """Faults of the newest message alone."""
        self._places = Places(tree.frames, _MAX_AGE_S, self._lost)
        for links in tree.links:
            self._places.add(links, static=True)
        self._works: dict[str, Callable[[Any, float], Played | None]] = {
            "odometry": self._odometry,
            "scan": self._scan,
            "detections": self._detections,
            "tf": lambda message, _: self._places.add(message, static=False),
            "tf_static": lambda message, _: self._places.add(message, static=True),
        }

    def observe(self, role: str, message: object, now: float) -> Played | None:
        """The observation of one message; ``now`` is when it was written (s).

        Raises:
            UnreadableError: values out of range, or a place that is unknown.
        """
        self._lost.clear()
        played = self._works[role](message, now)
        if played is None and role in _CHOSEN:
            faults = self._lost.faults(now)
            why = "; ".join(f"{fault.code}, {fault.about}" for fault in faults)
            raise UnreadableError("unplaced", why)
        return played

    def _odometry(self, message: ros.Odometry, now: float) -> Odometry | None:
        place = self._places.locate(message, now)
        if place is None:
            return None
        twist = read_twist(message.twist.twist)
        return Odometry("", UNKNOWN_ORIGIN, place.flat(), twist)

    def _scan(self, message: ros.LaserScan, now: float) -> LaserScan | None:
        frame, stamp = message.header.frame_id, message.header.stamp.seconds
        if self._tree.frames.base_link not in self._tree.chain(frame.lstrip("/"))[1:]:
            # The bag lacks the place of this frame on the robot.
            return replace(read_scan(message, IDENTITY), mount=self._mount)
        mount = self._places.on_robot(frame, stamp, now)
        return None if mount is None else read_scan(message, mount)

    def _detections(self, message: Message, now: float) -> DetectionFrame:
        if isinstance(message, d.DetectionArray):
            boxes = message.detections
            if boxes and not any(box.bbox3d.frame_id for box in boxes):
                raise UnreadableError("no_depth", "boxes in a picture")
        return self._places.detections(message, "detections", now)


class BagTree:
    """Frames of a bag, as its beginning has them.

    Args:
        static: All static messages.
        moving: The first messages of ``/tf``.
        odometry: The first odometry; None without.

    Attributes:
        frames: Names of the robot's frames in the bag.
        links: Transforms that are known before the first message.
        chain: Returns a frame and all its ancestors.
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
        self.chain, usual, odom, base = known.chain, Frames(), "", ""
        if odometry is not None:
            odom = odometry.header.frame_id.lstrip("/")
            base = odometry.child_frame_id.lstrip("/")
        odom, base = odom or usual.odom, base or usual.base_link
        if usual.base_link in self.chain(base) or base in self.chain(usual.base_link):
            base = usual.base_link  # odometry of a footprint
        self.frames = usual.model_copy(update={"odom": odom, "base_link": base})
        self.links = [*static]
        if usual.map not in self.chain(odom):
            header = ros.Header(frame_id=usual.map)
            root = ros.TransformStamped(header, self.chain(odom)[-1])
            self.links.append(ros.TFMessage((root,)))


# --- bags -------------------------------------------------------------------------

_LONGEST_S = 1e7
_LINKS_AHEAD = 2000
"""Messages of TF that are read before the first pass to learn the frames."""


class Bag:
    """One recording of ROS, read from its start as often as asked, never held whole.

    Args:
        path: A file ``.db3`` or ``.mcap``, or a directory.
        named: Topics to read, by role.
        mount: The laser's pose in ``base_link``, unless the bag has it.

    Raises:
        DataFileError: it cannot be read, or several of its topics fit a role.
    """

    def __init__(self, path: Path, named: NamedTopics, mount: Pose2D) -> None:
        self._path, self._mount = path, mount
        with _open(path) as reader:
            topics = {
                (connection.topic, connection.msgtype)
                for connection in reader.connections
                if _is_readable(path, connection)
            }
        self._roles = roles_of(path, topics, named)
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
        bag_pass = BagPass(self._tree, self._mount)
        start: float | None = None
        for topic, logged_s, payload in self._records():
            name, kind = topic
            try:
                message: Any = cdr.read(_FORMS[kind], payload)
                played = bag_pass.observe(self._roles[topic], message, logged_s)
            except UnreadableError as error:
                self._report(name, logged_s, str(error))
                continue
            if played is None:
                continue
            at = message.header.stamp.seconds if self._has_stamps else logged_s
            start = at if start is None else start
            if abs(at - start) <= _LONGEST_S:
                yield RecordingEntry(at - start, played)

    def _records(self, *roles: str) -> Iterator[tuple[Topic, float, bytes]]:
        """Messages with these roles, or all that are read; when written (Unix s)."""
        topics = {
            topic for topic, role in self._roles.items() if not roles or role in roles
        }
        with _open(self._path) as reader:
            connections = [
                connection
                for connection in reader.connections
                if (connection.topic, connection.msgtype) in topics
            ]
            records = reader.messages(connections=connections) if connections else ()
            for source, logged, data in records:
                yield (source.topic, source.msgtype), logged / 1e9, bytes(data)

    def _messages(self, *roles: str) -> Iterator[Any]:
        """Messages with these roles that can be read."""
        for (_, kind), _, payload in self._records(*roles):
            with suppress(UnreadableError):
                yield cdr.read(_FORMS[kind], payload)

    def _report(self, name: str, logged_s: float, why: str) -> None:
        if name not in self._reported:
            self._reported.add(name)
            _log.warning(
                "%s, %s: unusable messages are skipped, such as at %d ns: %s",
                self._path,
                name,
                round(logged_s * 1e9),
                why,
            )


@contextmanager
def _open(path: Path) -> Iterator[Reader]:
    try:
        with Reader(path) as reader:
            yield reader
    except Exception as error:  # any error of a foreign or damaged file
        message = " ".join(str(error).split()) or type(error).__name__
        raise _unusable(path, f"cannot be read: {message.rstrip('.')}") from error
