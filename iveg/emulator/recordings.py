"""Recordings of any kind as entries in time: logs of JSON lines, bags of ROS."""

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from iveg.adapters.bags import Bag, BagMessage, BagTopics
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Odometry
from iveg.emulator.logs import Entry, LogReader

_LOGS, _BAGS = (".jsonl", ".gz"), (".db3", ".mcap", ".bag")
_LONGEST_S = 1e7


class Recording(Protocol):
    """One recorded run of one robot."""

    def entries(self) -> Iterator[Entry]:
        """All entries from the start; at least one is odometry.

        Raises:
            DataFileError: the recording breaks off.
        """


def open_recording(
    path: Path,
    mount: Pose2D,
    topics: BagTopics | None = None,
    *,
    bag_time: bool = False,
) -> Recording:
    """Open a recording by its name.

    Args:
        path: ``.jsonl``, ``.jsonl.gz``, ``.db3``, ``.mcap``, ``.bag``, or a directory.
        mount: Where the laser of a bag sits in ``base_link``; logs say it themselves.
        topics: Which of a bag are read.
        bag_time: A bag plays by when it was recorded, not by the stamps of its sensors.

    Raises:
        DataFileError: it is of no known kind, cannot be read or holds no odometry.
    """
    if path.is_dir() or path.suffix in _BAGS:
        bag = Bag(path, topics or BagTopics(), mount)
        return BagRecording(str(path), bag, bag_time=bag_time)
    if path.suffix in _LOGS:
        return LogReader(path)
    known = ", ".join((*_LOGS[:1], ".jsonl.gz", *_BAGS))
    reason = f"is none of {known}, and no directory of a bag."
    raise DataFileError(str(path), "", reason)


class BagRecording:
    """A bag whose messages come by the stamps of their sensors, or by bag time.

    Stamps count unless the first message has none: a bag without them, or one that is
    asked to, plays by bag time throughout, since the two clocks may differ by years.

    Raises:
        DataFileError: the bag holds no odometry that can be used.
    """

    def __init__(self, name: str, bag: Bag, *, bag_time: bool) -> None:
        self._bag = bag
        first = next(bag.messages(), None)
        self._by_bag = bag_time or (first is not None and first.stamp_s <= 0.0)
        self._start = 0.0 if first is None else self._time_of(first)
        if not any(isinstance(one.observation, Odometry) for one in self.entries()):
            raise DataFileError(name, "", "holds no odometry that can be used.")

    def entries(self) -> Iterator[Entry]:
        """All entries from the start; one whose stamp is absurd is left out."""
        for message in self._bag.messages():
            at = self._time_of(message) - self._start
            if abs(at) <= _LONGEST_S:
                yield Entry(at, message.observation)

    def _time_of(self, message: BagMessage) -> float:
        return message.logged_s if self._by_bag else message.stamp_s
