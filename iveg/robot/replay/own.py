"""Recordings of iVeg's own as runs of a robot (docs/interfaces/recordings.md)."""

from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from iveg.adapters.recordings.incoming import NOTIFICATIONS
from iveg.adapters.recordings.mcap_file import Channel
from iveg.adapters.recordings.reading import is_own, read_messages
from iveg.domain.errors import DataFileError, UnreadableError
from iveg.domain.observations import (
    DetectionFrame,
    LaserScan,
    Observation,
    Odometry,
    UnreadScan,
)
from iveg.ngsi import codec
from iveg.robot.replay.logs import RecordingEntry

__all__ = ["OwnRecording", "is_own"]

Played = Odometry | LaserScan | DetectionFrame
_MEASURE = "iveg.Measure"
_Identity = tuple[str, type[Observation], str | None, int | None]


class OwnRecording:
    """The run of one robot; of two copies of a message the first counts.

    Args:
        path: An MCAP file that iVeg wrote.
        robot_id: Whose run; None: of the only robot in it.

    Raises:
        DataFileError: it cannot be read, or leaves open which robot is meant.
    """

    def __init__(self, path: Path, robot_id: str | None) -> None:
        self._path = path
        self._robot_id = robot_id or self._only_robot()

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries, in the order in which they came.

        Raises:
            DataFileError: the recording breaks off.
        """
        known: set[_Identity] = set()
        start: float | None = None
        with read_messages(self._path) as reading:
            for channel, log_time, payload in reading:
                at = reading.seconds(log_time)
                for played in _played(channel, payload):
                    if played.robot_id != self._robot_id or _is_known(played, known):
                        continue
                    start = at if start is None else start
                    yield RecordingEntry(at - start, played)
        if not reading.is_whole:
            raise self._unusable("breaks off; iVeg finishes it at its next start.")

    def _only_robot(self) -> str:
        with read_messages(self._path) as reading:
            robots = {
                played.robot_id
                for channel, _, payload in reading
                for played in _played(channel, payload)
            }
        if len(robots) == 1:
            return robots.pop()
        if not robots:
            raise self._unusable("holds nothing of a robot that this iVeg can read.")
        held = ", ".join(sorted(robots))
        raise self._unusable(f"holds {held}: name one as {self._path.name}#ROBOT.")

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self._path), "", reason)


def _played(channel: Channel, payload: bytes) -> Iterator[Played]:
    """What a message tells of a robot's run; nothing where it cannot be read."""
    try:
        if channel.schema == _MEASURE:
            device = _device_of(channel.topic)
            observations = codec.read_measure(device, payload).observations
        elif channel.topic == NOTIFICATIONS.topic:
            observations = codec.read_notification(payload)[1].observations
        else:
            return
        for one in observations:
            read = one.read() if isinstance(one, UnreadScan) else one
            if isinstance(read, get_args(Played)):
                yield read
    except UnreadableError:
        return


def _device_of(topic: str) -> str:
    """``/{apikey}/{device}/attrs``, or ``/{robot}/iveg/{what}`` past the agent."""
    _, first, second, last = topic.split("/")
    return second if last in ("attrs", "cmdexe") else f"{first}_{last}"


def _is_known(played: Played, known: set[_Identity]) -> bool:
    """Whether a copy of it came before, where its sender counts."""
    origin = played.origin
    identity = played.robot_id, type(played), origin.boot, origin.seq
    if origin.seq is None or identity not in known:
        known.add(identity)
        return False
    return True
