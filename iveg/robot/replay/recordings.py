"""Recordings of any format as entries in time: logs of JSON lines, ROS bags."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import REST, Pose2D
from iveg.domain.observations import Odometry, Origin
from iveg.robot.replay.bags import Bag, BagTopics
from iveg.robot.replay.logs import LogReader, RecordingEntry

_LOGS, _BAGS = (".jsonl", ".gz"), (".db3", ".mcap", ".bag")
_LONGEST_S = 1e7


Recording = Callable[[], Iterator[RecordingEntry]]
"""Plays one recorded run of one robot from the start; at least one entry is odometry.
It raises DataFileError when the recording is truncated."""


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
    if any(isinstance(one.observation, Odometry) for one in recording()):
        return recording
    if pose is None:
        reason = "holds no odometry that can be used; --pose says where it stands."
        raise DataFileError(str(path), "", reason)
    if next(recording(), None) is None:
        raise DataFileError(str(path), "", "holds nothing that can be used.")
    return partial(_fixed, recording, pose)


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
        first = next(bag.messages(), None)
        unstamped = first is not None and first.stamp_s <= 0.0
        return partial(_of_bag, bag, bag_time=bag_time or unstamped)
    if path.suffix in _LOGS:
        return LogReader(path).entries
    known = ", ".join((*_LOGS[:1], ".jsonl.gz", *_BAGS))
    reason = f"is none of {known}, and no directory of a bag."
    raise DataFileError(str(path), "", reason)


def _fixed(recording: Recording, pose: Pose2D) -> Iterator[RecordingEntry]:
    """Entries of a static sensor: its pose precedes all others."""
    entries = recording()
    first = next(entries)
    yield RecordingEntry(first.at, Odometry("", Origin(), pose, REST))
    yield first
    yield from entries


def _of_bag(bag: Bag, *, bag_time: bool) -> Iterator[RecordingEntry]:
    """Entries of a bag by sensor stamps, or by bag time; absurd stamps are omitted.

    Stamps count unless the first message has none: without stamps, or on request, a bag
    uses bag time throughout, since the two clocks may differ by years.
    """
    start: float | None = None
    for message in bag.messages():
        at = message.logged_s if bag_time else message.stamp_s
        start = at if start is None else start
        if abs(at - start) <= _LONGEST_S:
            yield RecordingEntry(at - start, message.observation)
