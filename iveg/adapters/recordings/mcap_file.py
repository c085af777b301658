"""MCAP files (https://mcap.dev/spec), compressed in chunks with an index: both ways.

Read back are whole files, parts, and what a crash left.
"""

import logging
import struct
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import orjson
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from iveg import __version__
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant

_log = logging.getLogger(__name__)
PROFILE = "iveg"
CHUNK_BYTES = 1 << 18
"""Of what is not compressed yet; a chunk ends when it has more."""
_NS = 10**9


@dataclass(frozen=True, slots=True)
class Channel:
    """A topic of a recording, with the name and JSON Schema of its messages."""

    topic: str
    schema: str
    shape: Mapping[str, object] = field(default_factory=lambda: {"type": "object"})


PADDING = Channel("/iveg/padding", "iveg.Padding")
_ZEROS = b'{"zeros":"' + b"0" * CHUNK_BYTES + b'"}'


class McapFile:
    """A recording that is being written; for one thread.

    A message's ``log_time`` is the wall clock at the beginning plus the monotonic time
    since then, so that a clock that is set neither reorders nor stretches it.

    Args:
        path: Must not exist.
        start: Its beginning, on both clocks.

    Raises:
        OSError: it cannot be made.  So may every method.
    """

    def __init__(self, path: Path, start: Instant) -> None:
        self.path, self.start = path, start
        self._start_ns = round(start.wall * _NS)
        self._stream = path.open("xb")
        self._writer = Writer(
            self._stream, CHUNK_BYTES, CompressionType.ZSTD, enable_data_crcs=False
        )
        self._writer.start(PROFILE, f"iveg {__version__}")
        began = {"wall": repr(start.wall), "mono": repr(start.mono)}
        self._writer.add_metadata(PROFILE, {"version": __version__, **began})
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._newest_ns = self._start_ns
        self._is_settled = True

    def add(self, channel: Channel, at: Instant, payload: bytes) -> None:
        """Append a message of JSON."""
        self.add_at(channel, self._ns(at), payload)

    def add_at(self, channel: Channel, log_time: int, payload: bytes) -> None:
        """Append a message at a time of this file's own (ns)."""
        number = self._channels.get(channel.topic)
        if number is None:
            number = self._register(channel)
        self._newest_ns = log_time
        self._writer.add_message(number, log_time, payload, log_time)
        self._is_settled = False

    def settle(self) -> None:
        """Have everything so far survive the process.

        The library ends a chunk by its size alone, so zeros fill it, which cost nothing
        once they are compressed.
        """
        if not self._is_settled:
            self.add_at(PADDING, self._newest_ns, _ZEROS)
            self._stream.flush()
            self._is_settled = True

    def finish(self) -> None:
        """Write the index, and close the file."""
        try:
            self._writer.finish()
        finally:
            self._stream.close()

    def _ns(self, at: Instant) -> int:
        return self._start_ns + round((at.mono - self.start.mono) * _NS)

    def _register(self, channel: Channel) -> int:
        schema = self._schemas.get(channel.schema)
        if schema is None:
            shape = orjson.dumps(channel.shape)
            schema = self._writer.register_schema(channel.schema, "jsonschema", shape)
            self._schemas[channel.schema] = schema
        number = self._writer.register_channel(channel.topic, "json", schema)
        self._channels[channel.topic] = number
        return number


# --- reading ----

RecordedMessage = tuple[Channel, int, bytes]
"""Channel, ``log_time`` (ns), payload."""
BROKEN = (
    McapError,
    CRCValidationError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    KeyError,
)
"""What reading says of a file that is cut off, damaged or of another format."""
LONGEST_RECORD = 1 << 28
_LARGEST_CHUNK = 1 << 26
"""Bytes of a chunk that is unpacked; ours have a quarter of a megabyte."""


def is_own(path: Path) -> bool:
    """Whether a file is a recording of iVeg's, and not another program's MCAP."""
    try:
        with path.open("rb") as stream:
            header = next(iter(_records(stream)))
    except (OSError, StopIteration, *BROKEN):
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
        except BROKEN:
            return
        self.is_whole = True

    def seconds(self, log_time: int) -> float:
        """Since the beginning (s)."""
        return (log_time - round(self.start.wall * _NS)) / _NS

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
        except BROKEN as error:
            raise self._unusable(f"is no MCAP: {error}.") from error
        raise self._unusable("is no recording of iVeg.")

    def _channel(self, record: ChannelRecord) -> Channel:
        schema = self._schemas[record.schema_id]
        return Channel(record.topic, schema.name, orjson.loads(schema.data))

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self.path), "", reason)


def unpack(chunk: Chunk) -> Sequence[McapRecord]:
    """The records of a chunk.  One of ``BROKEN`` is raised where it is damaged.

    A few bytes can claim to be gigabytes: the size is known before any is unpacked.
    """
    size = max(chunk.uncompressed_size, len(chunk.data))
    if chunk.compression == "zstd":
        size = max(size, zstandard.frame_content_size(chunk.data))
    elif chunk.compression:
        raise ValueError(f"compressed by {chunk.compression}")
    if size > _LARGEST_CHUNK:
        raise ValueError(f"a chunk of {size} bytes")
    return breakup_chunk(chunk, validate_crc=True)


def _records(stream: IO[bytes]) -> Iterator[McapRecord]:
    reader = StreamReader(
        stream,
        emit_chunks=True,
        validate_crcs=True,
        record_size_limit=LONGEST_RECORD,
    )
    for record in reader.records:
        if isinstance(record, Chunk):
            yield from unpack(record)
        else:
            yield record


# --- parts ------------------------------------------------------------------------


def write_excerpt(folder: Path, target: Path, since: float, until: float) -> int:
    """Copy what came in between two moments (Unix s); how many messages.

    A file that is damaged gives what can be read of it.

    Raises:
        HopError: the disk is full or away.
    """
    first, last = round(since * _NS), round(until * _NS)
    copied = 0
    try:
        excerpt = McapFile(target, Instant(0.0, since))
        for path in sorted(folder.glob("*.mcap*")):
            for channel, log_time, payload in _between(path, first, last):
                excerpt.add_at(channel, log_time, payload)
                copied += 1
        excerpt.finish()
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error
    return copied


def _between(path: Path, first: int, last: int) -> Iterator[RecordedMessage]:
    try:
        if path.suffix == ".mcap":
            yield from _by_index(path, first, last)
            return
        with read_messages(path) as reading:
            yield from (one for one in reading if first <= one[1] < last)
    except (DataFileError, McapError):
        return


def _by_index(path: Path, first: int, last: int) -> Iterator[RecordedMessage]:
    """Read only the chunks of a finished file that have these moments."""
    with path.open("rb") as stream:
        reader = make_reader(stream)
        found = reader.iter_messages(starting_at=first, ending_before=last)
        for schema, channel, message in found:
            if schema is not None and channel.topic != PADDING.topic:
                shape = orjson.loads(schema.data)
                name = Channel(channel.topic, schema.name, shape)
                yield name, message.log_time, message.data


# --- what a crash left --------------------------------------------------------------


def finish_broken(path: Path) -> None:
    """Put in the place of a file without an end what can be read of it, with an index.

    Takes minutes for an hour of many robots: not for the server's own process.

    Raises:
        HopError: the disk is full or away.
    """
    rescued = path.with_suffix(".rescued")
    try:
        rescued.unlink(missing_ok=True)
        with read_messages(path) as reading:
            file = McapFile(rescued, reading.start)
            for channel, log_time, payload in reading:
                file.add_at(channel, log_time, payload)
            file.finish()
        rescued.rename(path.with_suffix(""))
    except DataFileError as error:
        # Not even its beginning was on the disk.
        _log.info("%s", error)
    except OSError as error:
        # A disk that is full needs the room.
        rescued.unlink(missing_ok=True)
        raise HopError("disk", error.strerror or str(error)) from error
    path.unlink()
