"""Recordings of any format as entries in time: logs of JSON lines, ROS bags."""

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from iveg.adapters.bags import Bag, BagMessage, BagTopics
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Odometry, Origin
from iveg.emulator.logs import LogReader, RecordingEntry

_LOGS, _BAGS = (".jsonl", ".gz"), (".db3", ".mcap", ".bag")
_LONGEST_S = 1e7


class Recording(Protocol):
    """One recorded run of one robot."""

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries from the start; at least one is odometry.

        Raises:
            DataFileError: the recording is truncated.
        """


def open_recording(
    path: Path,
    mount: Pose2D,
    topics: BagTopics | None = None,
    *,
    bag_time: bool = False,
    pose: Pose2D | None = None,
) -> Recording:
    """Open a recording by its file name.

    Args:
        path: ``.jsonl``, ``.jsonl.gz``, ``.db3``, ``.mcap``, ``.bag``, or a directory.
        mount: Pose of a bag's laser in ``base_link``; logs contain it.
        topics: Topics of a bag that are read.
        bag_time: A bag is timed by its recording times, not by sensor stamps.
        pose: Fixed pose of a recording without odometry, such as a camera's.

    Raises:
        DataFileError: unknown format, unreadable file, or neither odometry nor a fixed
            pose.
    """
    recording = _opened(path, mount, topics, bag_time=bag_time, fixed=pose is not None)
    if any(isinstance(one.observation, Odometry) for one in recording.entries()):
        return recording
    if pose is None:
        reason = "holds no odometry that can be used; --pose says where it stands."
        raise DataFileError(str(path), "", reason)
    if next(recording.entries(), None) is None:
        raise DataFileError(str(path), "", "holds nothing that can be used.")
    return FixedRecording(recording, pose)


def _opened(
    path: Path,
    mount: Pose2D,
    topics: BagTopics | None,
    *,
    bag_time: bool,
    fixed: bool,
) -> Recording:
    if path.is_dir() or path.suffix in _BAGS:
        bag = Bag(path, topics or BagTopics(), mount, needs_odometry=not fixed)
        return BagRecording(bag, bag_time=bag_time)
    if path.suffix in _LOGS:
        return LogReader(path)
    known = ", ".join((*_LOGS[:1], ".jsonl.gz", *_BAGS))
    reason = f"is none of {known}, and no directory of a bag."
    raise DataFileError(str(path), "", reason)


class FixedRecording:
    """A recording of a static sensor: its pose precedes all other entries.

    Args:
        recording: Without odometry, and not empty.
        pose: Its pose in the frame of the recording.
    """

    def __init__(self, recording: Recording, pose: Pose2D) -> None:
        self._recording = recording
        self._stands = Odometry("", Origin(), pose, Twist2D(0.0, 0.0))

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries, the pose first."""
        entries = self._recording.entries()
        first = next(entries)
        yield RecordingEntry(first.at, self._stands)
        yield first
        yield from entries


class BagRecording:
    """A bag whose messages are ordered by sensor stamps, or by bag time.

    Stamps count unless the first message has none: without stamps, or on request, a bag
    uses bag time throughout, since the two clocks may differ by years.
    """

    def __init__(self, bag: Bag, *, bag_time: bool) -> None:
        self._bag = bag
        first = next(bag.messages(), None)
        self._by_bag = bag_time or (first is not None and first.stamp_s <= 0.0)
        self._start = 0.0 if first is None else self._time_of(first)

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries from the start; entries with absurd stamps are omitted."""
        for message in self._bag.messages():
            at = self._time_of(message) - self._start
            if abs(at) <= _LONGEST_S:
                yield RecordingEntry(at, message.observation)

    def _time_of(self, message: BagMessage) -> float:
        return message.logged_s if self._by_bag else message.stamp_s
