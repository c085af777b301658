"""ROS bags: odometry and laser scans from recordings of ROS 1 and ROS 2.

Reads ``.db3`` and ``.mcap`` files, directories of ROS 2 and ``.bag`` files through
rosbags.  The two messages are alike in all releases of ROS, so their usual definitions
serve and no other definition of a bag is used.  Left out: transforms; the odometry
frame is taken for ``map``, and the laser sits where the robot's profile says.
"""

import logging
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

from iveg.adapters.extras import require_extra
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import UNKNOWN_ORIGIN, LaserScan, Odometry
from iveg.robot.replay.logs import RecordingEntry
from iveg.robot.ros2.reading import read_pose, read_scan, read_twist
from iveg.robot.ros2.rigid import IDENTITY
from iveg.ros2 import messages as m

if TYPE_CHECKING:  # an extra: iveg[bags]
    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader as Ros1Reader
    from rosbags.rosbag2 import Reader as Ros2Reader

_log = logging.getLogger(__name__)
_LONGEST_S = 1e7
ODOMETRY, SCAN = "nav_msgs/msg/Odometry", "sensor_msgs/msg/LaserScan"


_Message = tuple[float, float, Odometry | LaserScan]
"""When the recorder wrote it, and what its header says (s); 0 where the sender filled
nothing in."""


@dataclass(frozen=True, slots=True)
class BagOptions:
    """How a bag is read.

    Attributes:
        odometry: Topic to read; None takes the only one of its type; ``scan`` likewise.
        bag_time: A bag is timed by its recording times, not by sensor stamps.
    """

    odometry: str | None = None
    scan: str | None = None
    bag_time: bool = False


AS_RECORDED = BagOptions()
"""The only topic of each type, by sensor stamps."""


class Bag:
    """One recording of ROS, read from its start as often as asked, never held whole.

    Args:
        path: A file ``.db3``, ``.mcap`` or ``.bag``, or a directory of ROS 2.
        options: Topics and clock.
        mount: The laser's pose in ``base_link``.
        needs_odometry: Whether a bag without it is refused.

    Raises:
        DataFileError: it cannot be read, or its topics leave open which is meant.
        MissingExtraError: rosbags is not installed.
    """

    def __init__(
        self,
        path: Path,
        options: BagOptions,
        mount: Pose2D,
        *,
        needs_odometry: bool = True,
    ) -> None:
        require_extra("bags", str(path))
        from rosbags.typesys import Stores, get_typestore

        self._path = path
        self._mount = mount
        self._is_ros1 = path.suffix == ".bag" and not path.is_dir()
        self._store = get_typestore(
            Stores.ROS1_NOETIC if self._is_ros1 else Stores.ROS2_HUMBLE
        )
        self._reported: set[str] = set()
        with self._open() as reader:
            found = reader.connections
            odometry = self._choose(found, ODOMETRY, options.odometry, "--odom-topic")
            scan = self._choose(found, SCAN, options.scan, "--scan-topic")
        if odometry is None and (needs_odometry or scan is None):
            raise self._unusable(f"holds no topic of type {ODOMETRY}")
        self._topics = {odometry: ODOMETRY} if odometry else {}
        self._topics |= {scan: SCAN} if scan else {}
        # Stamps count unless the first message has none: a bag uses one of the two
        # clocks throughout, since they may differ by years.
        _, stamp_s, _ = next(self._messages(), (0.0, 1.0, None))
        self._bag_time = options.bag_time or stamp_s <= 0.0

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries of both topics, in the order in which they were recorded.

        A message that cannot be used is skipped and reported once a topic; one with an
        absurd stamp is omitted.

        Raises:
            DataFileError: the recording breaks off.
        """
        start: float | None = None
        for logged_s, stamp_s, observation in self._messages():
            at = logged_s if self._bag_time else stamp_s
            start = at if start is None else start
            if abs(at - start) <= _LONGEST_S:
                yield RecordingEntry(at - start, observation)

    def _messages(self) -> Iterator[_Message]:
        with self._open() as reader:
            wanted = [
                one
                for one in reader.connections
                if self._topics.get(one.topic) == one.msgtype
            ]
            records = reader.messages(connections=wanted)
            while True:
                try:
                    connection, logged, data = next(records)
                except StopIteration:
                    return
                except Exception as error:  # whatever a damaged file provokes
                    raise self._unreadable(error) from error
                message = self._message(connection, logged, bytes(data))
                if message is not None:
                    yield message

    # --- the file -----------------------------------------------------------------

    @contextmanager
    def _open(self) -> "Iterator[Ros1Reader | Ros2Reader]":
        from rosbags.rosbag1 import Reader as Ros1Reader
        from rosbags.rosbag2 import Reader as Ros2Reader

        reader: Ros1Reader | Ros2Reader
        with ExitStack() as stack:
            try:
                reader = (
                    Ros1Reader(self._path) if self._is_ros1 else Ros2Reader(self._path)
                )
                stack.enter_context(reader)
            except Exception as error:  # whatever a foreign file provokes
                raise self._unreadable(error) from error
            yield reader

    def _choose(
        self, found: "list[Connection]", kind: str, wanted: str | None, option: str
    ) -> str | None:
        """The topic to read; None when there is none of its type."""
        topics = sorted({one.topic for one in found if one.msgtype == kind})
        there = f"{kind}: {', '.join(topics) or 'none'}"
        if wanted is not None:
            if wanted not in topics:
                raise self._unusable(f"{option} {wanted} is not among those of {there}")
            return wanted
        if len(topics) > 1:
            raise self._unusable(f"{option} must name one of those of {there}")
        return topics[0] if topics else None

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self._path), "", f"{reason}.")

    def _unreadable(self, error: Exception) -> DataFileError:
        said = " ".join(str(error).split()) or type(error).__name__
        return self._unusable(f"cannot be read: {said.rstrip('.')}")

    # --- its messages -------------------------------------------------------------

    def _message(
        self, connection: "Connection", logged: int, data: bytes
    ) -> _Message | None:
        try:
            stamp_s, observation = self._read(connection.msgtype, data)
        except Exception as error:  # whatever foreign bytes provoke
            if connection.topic not in self._reported:
                self._reported.add(connection.topic)
                _log.warning(
                    "%s, %s: unusable messages are skipped, such as at %d ns: %s",
                    self._path,
                    connection.topic,
                    logged,
                    str(error) or type(error).__name__,
                )
            return None
        return logged / 1e9, stamp_s, observation

    def _read(self, kind: str, data: bytes) -> tuple[float, Odometry | LaserScan]:
        store = self._store
        read = store.deserialize_ros1 if self._is_ros1 else store.deserialize_cdr
        message = read(data, kind)
        # The fields of its messages have the names that they have in ROS, as ours do.
        if kind == ODOMETRY:
            odometry = cast("m.Odometry", message)
            return _stamp_of(odometry), _odometry(odometry)
        scan = cast("m.LaserScan", message)
        return _stamp_of(scan), replace(read_scan(scan, IDENTITY), mount=self._mount)


def _stamp_of(message: "m.Odometry | m.LaserScan") -> float:
    # A time of rosbags has the fields of ours and none of its properties.
    stamp = message.header.stamp
    return float(stamp.sec + stamp.nanosec / 1e9)


def _odometry(message: m.Odometry) -> Odometry:
    """Seen from above: pose in the odometry frame, twist in the robot's own."""
    pose, twist = read_pose(message), read_twist(message.twist.twist)
    return Odometry("", UNKNOWN_ORIGIN, pose.flat(), twist)
