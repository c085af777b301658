"""Recordings of any format as entries in time: logs of JSON lines, ROS bags, iVeg's."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import REST, Pose2D
from iveg.domain.observations import Odometry, Origin
from iveg.robot.replay.bags import AS_RECORDED, Bag, BagOptions
from iveg.robot.replay.logs import LogReader, RecordingEntry
from iveg.robot.replay.own import OwnRecording, is_own

_LOGS, _BAGS = (".jsonl", ".gz"), (".db3", ".mcap", ".bag")


Recording = Callable[[], Iterator[RecordingEntry]]
"""Plays one recorded run of one robot from the start; at least one entry is odometry.
It raises DataFileError when the recording is truncated."""


def open_recording(
    path: Path,
    mount: Pose2D,
    bag: BagOptions = AS_RECORDED,
    *,
    pose: Pose2D | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Recording:
    """Open a recording by its file name.

    Args:
        path: ``.jsonl``, ``.jsonl.gz``, ``.db3``, ``.mcap``, ``.bag``, or a directory;
            of iVeg's own recordings also ``FILE.mcap#ROBOT``.
        mount: Pose of a bag's laser in ``base_link``; logs contain it.
        bag: Topics and clock of a bag.
        pose: Fixed pose of a recording without odometry, such as a camera's.
        tell: Takes a line for each topic of a bag: what becomes of it.

    Raises:
        DataFileError: unknown format, unreadable file, or neither odometry nor a fixed
            pose.
    """
    recording = _opened(path, mount, bag, tell, fixed=pose is not None)
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
    bag: BagOptions,
    tell: Callable[[str], None],
    *,
    fixed: bool,
) -> Recording:
    stem, _, robot_id = str(path).partition(".mcap#")
    own = Path(f"{stem}.mcap") if robot_id else path
    if own.suffix == ".mcap" and is_own(own):
        return OwnRecording(own, robot_id or None).entries
    if robot_id and own.is_file():
        reason = (
            "is no recording of iVeg's that can be read, so # names no robot in it."
        )
        raise DataFileError(str(own), "", reason)
    if path.is_dir() or path.suffix in _BAGS:
        opened = Bag(path, bag, mount, needs_odometry=not fixed)
        for line in (f"{path}:", *opened.plan.table()):
            tell(line)
        return opened.entries
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
