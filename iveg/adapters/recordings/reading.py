"""Recordings of iVeg's own, read back: whole ones, and what a crash left."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import orjson
import zstandard
from mcap.exceptions import McapError
from mcap.records import Channel as ChannelRecord
from mcap.records import Header, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader

from iveg.adapters.recordings.mcap_file import PADDING, PROFILE, Channel
from iveg.domain.errors import DataFileError
from iveg.domain.observations import Instant

RecordedMessage = tuple[Channel, int, bytes]
"""Channel, ``log_time`` (ns), payload."""
_BROKEN = (
    McapError,
    CRCValidationError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    KeyError,
)
_LONGEST_RECORD = 1 << 28


def is_own(path: Path) -> bool:
    """Whether a file is a recording of iVeg's, and not another program's MCAP."""
    try:
        with path.open("rb") as stream:
            header = next(iter(_records(stream)))
    except (OSError, StopIteration, *_BROKEN):
        return False
    return isinstance(header, Header) and header.profile == PROFILE


@contextmanager
def read_messages(path: Path) -> Iterator["Reading"]:
    """Open a recording.

    Raises:
        DataFileError: it cannot be read, or no iVeg wrote it.
    """
    try:
        with path.open("rb") as stream:
            yield Reading(path, stream)
    except OSError as error:
        raise DataFileError(str(path), "", f"cannot be read: {error}.") from error


@dataclass
class Reading:
    """Messages in the order in which they came, as far as the file can be read.

    Attributes:
        start: Its beginning, on both clocks.
        is_whole: Whether nothing is missing at its end; known once it was read.
    """

    path: Path
    stream: IO[bytes]
    is_whole: bool = False
    _channels: dict[int, Channel] = field(default_factory=dict)
    _schemas: dict[int, Schema] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._records = _records(self.stream)
        self.start = self._begin()

    def __iter__(self) -> Iterator[RecordedMessage]:
        """Raises nothing of the format: a file ends where it cannot be read on."""
        try:
            for record in self._records:
                if isinstance(record, Schema):
                    self._schemas[record.id] = record
                elif isinstance(record, ChannelRecord):
                    self._channels[record.id] = self._channel(record)
                elif isinstance(record, Message):
                    channel = self._channels[record.channel_id]
                    if channel != PADDING:
                        yield channel, record.log_time, record.data
        except _BROKEN:
            return
        self.is_whole = True

    def seconds(self, log_time: int) -> float:
        """Since the beginning (s)."""
        return (log_time - round(self.start.wall * 1e9)) / 1e9

    def instant(self, log_time: int) -> Instant:
        """The moment on both clocks, where the wall clock was not set meanwhile."""
        return self.start.later(self.seconds(log_time))

    def _begin(self) -> Instant:
        try:
            for record in self._records:
                if isinstance(record, Metadata) and record.name == PROFILE:
                    began = record.metadata
                    return Instant(float(began["mono"]), float(began["wall"]))
                if not isinstance(record, Header) or record.profile != PROFILE:
                    break
        except _BROKEN as error:
            raise self._unusable(f"is no MCAP: {error}.") from error
        raise self._unusable("is no recording of iVeg.")

    def _channel(self, record: ChannelRecord) -> Channel:
        schema = self._schemas[record.schema_id]
        return Channel(record.topic, schema.name, orjson.loads(schema.data))

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self.path), "", reason)


def _records(stream: IO[bytes]) -> Iterator[object]:
    reader = StreamReader(stream, validate_crcs=True, record_size_limit=_LONGEST_RECORD)
    yield from reader.records
