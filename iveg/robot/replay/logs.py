"""Recorded runs as files: JSON lines, plain or gzipped (docs/interfaces/replay.md).

A file is read line by line and never held in memory.  A line that cannot be used is
reported once with file and line number and skipped; a file that cannot be used at all
stops the start with one sentence.
"""

import gzip
import logging
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Annotated, Literal

from pydantic import Field, TypeAdapter, ValidationError

from iveg.domain.errors import DataFileError, UnreadableError
from iveg.domain.geometry import Pose2D, Twist2D, box_of_a_person
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Odometry,
    Origin,
)
from iveg.ngsi.codec import load_json
from iveg.ngsi.codec.scans import ranges_of
from iveg.ngsi.payloads import LidarPoints, Metres, Radians, Speed, Text, Wire
from iveg.ngsi.texts import FORBIDDEN

_log = logging.getLogger(__name__)
_LONGEST_LINE = 1 << 20


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """One line of a log, or one message of a bag.

    Attributes:
        at: Seconds from the start of the recording.
    """

    at: float
    observation: Odometry | LaserScan | Detection | DetectionFrame


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

        Raises:
            DataFileError: the compressed file is truncated, or was removed.
        """
        try:
            with self._open() as lines:
                number = 0
                while line := lines.readline(_LONGEST_LINE):
                    number += 1
                    entry = self._entry(number, line)
                    while len(line) == _LONGEST_LINE and not line.endswith(b"\n"):
                        line = lines.readline(_LONGEST_LINE)
                    if entry is not None:
                        yield entry
        except (OSError, EOFError, zlib.error) as error:
            reason = f"cannot be read: {error}."
            raise DataFileError(str(self._file), "", reason) from error

    def _open(self) -> IO[bytes] | gzip.GzipFile:
        if self._file.suffix == ".gz":
            return gzip.open(self._file, "rb")
        return self._file.open("rb")

    def _entry(self, number: int, line: bytes) -> RecordingEntry | None:
        if not line.strip():
            return None
        try:
            return _read(line)
        except UnreadableError as error:
            why = str(error)
        except ValidationError as error:
            complaint = error.errors(include_input=False, include_url=False)[0]
            place = ".".join(str(part) for part in complaint["loc"][1:])
            why = f"{place}: {complaint['msg']}" if place else complaint["msg"]
        if number not in self._reported:
            self._reported.add(number)
            _log.warning("%s, line %d skipped: %s", self._file, number, why)
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
        box = box_of_a_person(self.x, self.y)
        return Detection(self.class_, self.probability, box, "map")


_LINE: TypeAdapter[_OdometryLine | _ScanLine | _DetectionLine] = TypeAdapter(
    Annotated[_OdometryLine | _ScanLine | _DetectionLine, Field(discriminator="kind")]
)


def _read(line: bytes) -> RecordingEntry:
    if len(line) >= _LONGEST_LINE:
        raise UnreadableError("too_long", f"more than {_LONGEST_LINE} bytes")
    value = _LINE.validate_python(load_json(line))
    return RecordingEntry(value.t, value.observation())
