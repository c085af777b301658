"""MCAP files (https://mcap.dev/spec), compressed in chunks with an index: both ways.

Read back are whole files, parts, and what a crash left.
"""

import contextlib
import logging
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Final, NamedTuple

import zstandard
from mcap.exceptions import McapError
from mcap.reader import McapReader, NonSeekingReader, make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from iveg import __version__
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant

_log = logging.getLogger(__name__)
PROFILE: Final = "iveg"
CHUNK_BYTES: Final = 1 << 22
"""Of what is not compressed yet; a chunk ends when it has more.  The index is in memory
until the end of a file: of ten robots it grows by 4 MB in five minutes, and by 9 MB
with chunks of 1 MB."""
_PADDING: Final = "/iveg/padding"
"""Topic of zeros by which earlier versions ended a chunk."""
_NS: Final = 10**9
FOREVER: Final = 9e9
"""Later than every moment of a recording (Unix s)."""


class Channel(NamedTuple):
    """A topic of a recording, with the name and JSON Schema of its messages."""

    topic: str
    schema: str
    shape: bytes = b'{"type":"object"}'


NOTIFICATIONS: Final = Channel("/ngsi/notifications", "ngsi.Notification")
MEASURE: Final = "iveg.Measure"
"""Schema of robots' own messages."""
RecordedMessage = tuple[Channel, int, bytes]
"""Channel, ``log_time`` (ns), payload."""


class McapFile:
    """A recording that is being written; for one thread at a time.

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

    def add(self, channel: Channel, at: Instant, payload: bytes) -> None:
        """Append a message of JSON."""
        log_time = self._start_ns + round((at.mono - self.start.mono) * _NS)
        self.add_at(channel, log_time, payload)

    def add_at(self, channel: Channel, log_time: int, payload: bytes) -> None:
        """Append a message at a time of this file's own (ns)."""
        number = self._channels.get(channel.topic)
        if number is None:
            number = self._register(channel)
        self._writer.add_message(number, log_time, payload, log_time)

    def flush(self) -> None:
        """Have everything so far survive the process."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the index, and close the file."""
        try:
            self._writer.finish()
        finally:
            self._stream.close()

    def _register(self, channel: Channel) -> int:
        topic, name, shape = channel
        schema = self._schemas.get(name)
        if schema is None:
            schema = self._writer.register_schema(name, "jsonschema", shape)
            self._schemas[name] = schema
        number = self._writer.register_channel(topic, "json", schema)
        self._channels[topic] = number
        return number


# --- reading ----------------------------------------------------------------------

_LONGEST_RECORD, _LARGEST_CHUNK = 1 << 28, 1 << 26
"""Size that is read (bytes), on the disk and unpacked."""

_BROKEN = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    KeyError,
    MemoryError,
)
"""Errors of reading a file that is cut off, damaged or of another format."""


def is_own(path: Path) -> bool:
    """Whether a file is a recording of iVeg's, and not another program's MCAP."""
    try:
        with path.open("rb") as stream:
            return make_reader(stream).get_header().profile == PROFILE
    except (OSError, StopIteration, *_BROKEN):
        return False


def read_messages(
    path: Path, since: float = 0.0, until: float = FOREVER
) -> Iterator[RecordedMessage]:
    """Messages of a recording between two moments (Unix s), oldest first.

    Raises:
        DataFileError: behind the last that can be read, where the file breaks off.
        OSError: the disk refuses.
    """
    with path.open("rb") as stream:
        try:
            reader = _reader(stream)
            found = reader.iter_messages(
                # Only by an index can it be done without holding all of the file.
                log_time_order=not isinstance(reader, NonSeekingReader),
                starting_at=round(since * _NS),
                ending_before=round(until * _NS),
            )
            for schema, channel, message in found:
                if schema is not None and channel.topic != _PADDING:
                    name = Channel(channel.topic, schema.name, schema.data)
                    yield name, message.log_time, message.data
        except _BROKEN as error:
            raise DataFileError(str(path), "", f"breaks off: {error}.") from error


def _reader(stream: IO[bytes]) -> McapReader:
    """Reader by the index; without one, such as in an open file, from the beginning."""
    _refuse_bombs(stream)
    try:
        reader = make_reader(stream, validate_crcs=True)
        reader.get_summary()
    except (OSError, *_BROKEN):
        stream.seek(0)
        return NonSeekingReader(stream, validate_crcs=True)
    return reader


def _refuse_bombs(stream: IO[bytes]) -> None:
    """Check all chunks before one is unpacked: a few bytes can claim to be gigabytes.

    Raises:
        ValueError: a chunk is too large.
    """
    with contextlib.suppress(McapError, struct.error):
        for record in StreamReader(
            stream, emit_chunks=True, record_size_limit=_LONGEST_RECORD
        ).records:
            if isinstance(record, Chunk):
                size = max(
                    record.uncompressed_size, zstandard.frame_content_size(record.data)
                )
                if size > _LARGEST_CHUNK:
                    raise ValueError(f"a chunk of {size} bytes")
    stream.seek(0)


# --- parts, and what a crash left -------------------------------------------------


def write_excerpt(folder: Path, target: Path, since: float, until: float) -> int:
    """Copy what came in between two moments (Unix s); returns how many messages.

    A file that is damaged gives what can be read of it.

    Raises:
        HopError: the disk is full or away.
    """
    try:
        excerpt = McapFile(target, Instant(0.0, since))
        paths = sorted(folder.glob("*.mcap*"))
        copied = sum(_copy(path, excerpt, since, until) for path in paths)
        excerpt.finish()
    except OSError as error:
        raise HopError("disk", error.strerror or str(error)) from error
    return copied


def finish_broken(path: Path) -> None:
    """Put in the place of a file without an end what can be read of it, with an index.

    Takes minutes for an hour of many robots: not for the server's own process.

    Raises:
        HopError: the disk is full or away.
    """
    rescued = path.with_name("rescued")
    try:
        rescued.unlink(missing_ok=True)
        file = McapFile(rescued, _start_of(path))
        _copy(path, file)
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


def _copy(
    source: Path, target: McapFile, since: float = 0.0, until: float = FOREVER
) -> int:
    """Copy messages as far as they can be read; returns how many."""
    copied = 0
    # The file that is written gets another name when it is finished.
    with contextlib.suppress(DataFileError, FileNotFoundError):
        for channel, log_time, payload in read_messages(source, since, until):
            target.add_at(channel, log_time, payload)
            copied += 1
    return copied


def _start_of(path: Path) -> Instant:
    """Beginning of a recording on both clocks.  Raises DataFileError."""
    try:
        with path.open("rb") as stream:
            began = next(NonSeekingReader(stream).iter_metadata()).metadata
        return Instant(float(began["mono"]), float(began["wall"]))
    except (StopIteration, *_BROKEN) as error:
        raise DataFileError(str(path), "", "has not even a beginning.") from error
