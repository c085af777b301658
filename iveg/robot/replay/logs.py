"""Recorded runs as files: JSON lines, and recordings of iVeg's own."""

import gzip
import logging
import zlib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError

from iveg.adapters.recordings.mcap_file import (
    MEASURE,
    NOTIFICATIONS,
    Channel,
    is_own,
    read_messages,
)
from iveg.domain.errors import DataFileError, UnreadableError
from iveg.domain.geometry import Pose2D, Twist2D, person_box
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Observation,
    Odometry,
    Origin,
)
from iveg.domain.wire import (
    FORBIDDEN,
    LidarPoints,
    Metres,
    Radians,
    Speed,
    Text,
    Wire,
)
from iveg.ngsi import codec
from iveg.ngsi.codec import load_json
from iveg.ngsi.codec.fields import first_complaint
from iveg.ngsi.codec.incoming import ranges_of

# --- logs -------------------------------------------------------------------------
#
# JSON lines, plain or gzipped (docs/interfaces/replay.md).
#
# A file is read line by line and never held in memory.  A line that cannot be used is
# reported once with file and line number and skipped; a file that cannot be used at all
# stops the start with one sentence.

_log = logging.getLogger(__name__)
_PICTURE_S = 0.02
"""Detections within this time (s) are one frame; frames come 30 times a second."""
_SIGHTING_S = 0.4
"""Time (s of the recording) that detections count, unless others follow."""
_Timed = tuple[float, Odometry | LaserScan | Detection]
"""Seconds from the start, and the observation of a line."""
Played = Odometry | LaserScan | DetectionFrame
"""Observations that a replayed robot sends."""


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """One observation of a recording.

    Attributes:
        at: Seconds from the start of the recording.
    """

    at: float
    observation: Played


class LogReader:
    """Reader of one recording, repeatable; each bad line is reported once.

    Args:
        file: ``.jsonl`` or ``.jsonl.gz``.

    Raises:
        DataFileError: the file cannot be read.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._reported: set[int] = set()

    def entries(self) -> Iterator[RecordingEntry]:
        """All entries from the start, in the order of the file.

        A log has no empty frames.  After the first detection, odometry that comes
        0.4 s or more after the newest detection is followed by an empty frame.

        Raises:
            DataFileError: the compressed file is truncated, or was removed.
        """
        detections: tuple[Detection, ...] = ()
        newest: float | None = None
        for at, observation in self._lines():
            if isinstance(observation, Detection):
                is_same_picture = newest is not None and at - newest <= _PICTURE_S
                detections = (*(detections if is_same_picture else ()), observation)
                newest = at
                yield RecordingEntry(at, DetectionFrame("", Origin(), detections))
                continue
            yield RecordingEntry(at, observation)
            is_odometry = isinstance(observation, Odometry)
            if is_odometry and newest is not None and at - newest >= _SIGHTING_S:
                yield RecordingEntry(at, DetectionFrame("", Origin(), ()))

    def _lines(self) -> Iterator[_Timed]:
        try:
            with self._open() as lines:
                for number, line in enumerate(lines, 1):
                    timed = self._read(number, line)
                    if timed is not None:
                        yield timed
        except (OSError, EOFError, zlib.error) as error:
            reason = f"cannot be read: {error}."
            raise DataFileError(str(self._file), "", reason) from error

    def _open(self) -> IO[bytes] | gzip.GzipFile:
        is_packed = self._file.suffix == ".gz"
        return gzip.open(self._file) if is_packed else self._file.open("rb")

    def _read(self, number: int, line: bytes) -> _Timed | None:
        if not line.strip():
            return None
        try:
            value = _LINE.validate_python(load_json(line))
            return value.t, value.observation()
        except UnreadableError as error:
            reason = str(error)
        except ValidationError as error:
            reason = first_complaint(error)
        if number not in self._reported:
            self._reported.add(number)
            _log.warning("%s, line %d skipped: %s", self._file, number, reason)
        return None


# --- the shapes of a line ---------------------------------------------------------


class _Line(Wire):
    t: Annotated[float, Field(ge=0, le=1e7)]


class _OdometryLine(_Line):
    kind: Literal["odom"]
    x: Metres
    y: Metres
    yaw: Radians
    v: Speed = 0.0
    w: Speed = 0.0

    def observation(self) -> Odometry:
        pose = Pose2D(self.x, self.y, self.yaw)
        return Odometry("", Origin(), pose, Twist2D(self.v, self.w))


class _ScanLine(_Line):
    kind: Literal["scan"]
    angle_min: Radians
    angle_increment: Radians
    range_min: Annotated[float, Field(ge=0, le=1e4)] = 0.0
    range_max: Annotated[float, Field(gt=0, le=1e4)]
    ox: Metres = 0.0
    oy: Metres = 0.0
    ranges: LidarPoints

    def observation(self) -> LaserScan:
        return LaserScan(
            "",
            Origin(),
            self.angle_min,
            self.angle_increment,
            self.range_min,
            self.range_max,
            Pose2D(self.ox, self.oy, 0.0),
            ranges_of(self.ranges),
        )


class _DetectionLine(_Line):
    kind: Literal["detection"]
    class_: Annotated[Text, Field(alias="class", min_length=1)]
    probability: Annotated[float, Field(ge=0, le=1)]
    x: Metres
    y: Metres

    def observation(self) -> Detection:
        if not FORBIDDEN.isdisjoint(self.class_):
            raise UnreadableError("bad_class", "none of < > \" ' = ; ( ) is allowed")
        box = person_box(self.x, self.y)
        return Detection(self.class_, self.probability, box, "map")


_LINE: TypeAdapter[_OdometryLine | _ScanLine | _DetectionLine] = TypeAdapter(
    Annotated[_OdometryLine | _ScanLine | _DetectionLine, Field(discriminator="kind")]
)


# --- own --------------------------------------------------------------------------
#
# Recordings of iVeg's own as runs of a robot (docs/interfaces/recordings.md).

__all__ = ["OwnRecording", "is_own"]

_Identity = tuple[str, type[Observation], str | None, int | None]


class OwnRecording:
    """The run of one robot; of two copies of a message the first counts.

    Args:
        path: An MCAP file that iVeg wrote.
        robot_id: The robot; None: the only robot in it.

    Raises:
        DataFileError: it cannot be read, or holds several robots and none is named.
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
        start: int | None = None
        for at, played in self._all():
            if played.robot_id != self._robot_id or _is_known(played, known):
                continue
            start = at if start is None else start
            yield RecordingEntry((at - start) / 1e9, played)

    def _all(self) -> Iterator[tuple[int, Played]]:
        """Observations of all robots, with their times (ns).  Raises DataFileError."""
        try:
            for channel, log_time, payload in read_messages(self._path):
                for played in _played(channel, payload):
                    yield log_time, played
        except OSError as error:
            raise self._unusable(f"cannot be read: {error}.") from error

    def _only_robot(self) -> str:
        robots: set[str] = set()
        # A robot of a damaged file is played up to the damage.
        with suppress(DataFileError):
            robots.update(played.robot_id for _, played in self._all())
        if len(robots) == 1:
            return robots.pop()
        if not robots:
            raise self._unusable("holds nothing of a robot that this iVeg can read.")
        names = ", ".join(sorted(robots))
        raise self._unusable(f"holds {names}: name one as {self._path.name}#ROBOT.")

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self._path), "", reason)


def _played(channel: Channel, payload: bytes) -> Iterator[Played]:
    """Observations of a robot's run in a message; none where it cannot be read."""
    try:
        if channel.schema == MEASURE:
            device = _device_of(channel.topic)
            observations = codec.read_measure(device, payload).observations
        elif channel.topic == NOTIFICATIONS.topic:
            observations = codec.read_notification(payload)[1].observations
        else:
            return
        for observation in observations:
            if isinstance(observation, Played):
                yield observation
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
