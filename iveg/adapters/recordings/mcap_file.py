"""Writing and reading of MCAP files (https://mcap.dev/spec): compressed, with an index.

Reading takes whole files, parts, and files that a crash left.
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
from iveg.adapters.files import disk_errors
from iveg.domain.errors import DataFileError, HopError
from iveg.domain.observations import Instant

_log = logging.getLogger(__name__)
PROFILE: Final = "iveg"
CHUNK_BYTES: Final = 1 << 22
"""Size of a chunk before compression (bytes).  The index is in memory until the end of
a file: for ten robots it grows by 4 MB in five minutes, with chunks of 1 MB by 9 MB."""
_PADDING: Final = "/iveg/padding"
"""Topic of zeros with which earlier versions ended a chunk."""
_NS: Final = 10**9
FOREVER: Final = 9e9
"""Later than every moment of a recording (Unix s)."""


class Channel(NamedTuple):
    """Topic of a recording, with the name and JSON Schema of its messages."""

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
    since then, so that setting the clock neither reorders nor stretches the file.

    Args:
        path: Path of the file, which must not exist.
        start: Its beginning, on both clocks.

    Raises:
        OSError: it cannot be made.  Every method may raise it, too.
    """

    def __init__(self, path: Path, start: Instant) -> None:
        self.path, self.start = path, start
        self._start_ns = round(start.wall * _NS)
        self._stream = path.open("xb")
        self._writer = Writer(
            self._stream, CHUNK_BYTES, CompressionType.ZSTD, enable_data_crcs=False
        )
        self._writer.start(PROFILE, f"iveg {__version__}")
        self._writer.add_metadata(
            PROFILE,
            {
                "version": __version__,
                "wall": repr(start.wall),
                "mono": repr(start.mono),
            },
        )
        self._channels, self._schemas = dict[str, int](), dict[str, int]()

    def add(self, channel: Channel, at: Instant, payload: bytes) -> None:
        """Append a message of JSON."""
        since_start_ns = round((at.mono - self.start.mono) * _NS)
        self.add_at(channel, self._start_ns + since_start_ns, payload)

    def add_at(self, channel: Channel, log_time: int, payload: bytes) -> None:
        """Append a message at a ``log_time`` of this file (ns)."""
        number = self._channels.get(channel.topic)
        if number is None:
            number = self._channels[channel.topic] = self._register(channel)
        self._writer.add_message(number, log_time, payload, log_time)

    def flush(self) -> None:
        """Write everything so far, so that it survives the process."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the index, and close the file."""
        try:
            self._writer.finish()
        finally:
            self._stream.close()

    def _register(self, channel: Channel) -> int:
        topic, name, shape = channel
        if name not in self._schemas:
            schema = self._writer.register_schema(name, "jsonschema", shape)
            self._schemas[name] = schema
        return self._writer.register_channel(topic, "json", self._schemas[name])


# --- reading ----------------------------------------------------------------------

_LONGEST_RECORD, _LARGEST_CHUNK = 1 << 28, 1 << 26
"""Limits of what is read (bytes), on the disk and unpacked."""

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
    """Whether iVeg recorded a file, and not another program that writes MCAP."""
    with (
        contextlib.suppress(OSError, StopIteration, *_BROKEN),
        path.open("rb") as stream,
    ):
        return make_reader(stream).get_header().profile == PROFILE
    return False


def read_messages(
    path: Path, since: float = 0.0, until: float = FOREVER
) -> Iterator[RecordedMessage]:
    """Messages of a recording between two moments (Unix s), oldest first.

    Raises:
        DataFileError: after the last readable message, where the file breaks off.
        OSError: the disk refuses.
    """
    with path.open("rb") as stream:
        try:
            reader = _reader(stream)
            for schema, channel, message in reader.iter_messages(
                # Without an index, sorting would hold the whole file in memory.
                log_time_order=not isinstance(reader, NonSeekingReader),
                starting_at=round(since * _NS),
                ending_before=round(until * _NS),
            ):
                if schema is not None and channel.topic != _PADDING:
                    yield (
                        Channel(channel.topic, schema.name, schema.data),
                        message.log_time,
                        message.data,
                    )
        except _BROKEN as error:
            raise DataFileError(str(path), "", f"breaks off: {error}.") from error


def _reader(stream: IO[bytes]) -> McapReader:
    """Reader by the index; an open file has none and is read from the beginning."""
    _refuse_bombs(stream)
    try:
        reader = make_reader(stream, validate_crcs=True)
        reader.get_summary()
    except (OSError, *_BROKEN):
        stream.seek(0)
        return NonSeekingReader(stream, validate_crcs=True)
    return reader


def _refuse_bombs(stream: IO[bytes]) -> None:
    """Check the size of all chunks before any is unpacked.

    A few bytes can claim to be gigabytes.  A damaged chunk ends only the reading.

    Raises:
        ValueError: a chunk is too large, or may be.
    """
    with contextlib.suppress(McapError, struct.error):
        for record in StreamReader(
            stream, emit_chunks=True, record_size_limit=_LONGEST_RECORD
        ).records:
            if isinstance(record, Chunk):
                size = record.uncompressed_size
                with contextlib.suppress(zstandard.ZstdError):
                    size = max(size, zstandard.frame_content_size(record.data))
                # The library unpacks lz4 without a limit.
                if size > _LARGEST_CHUNK or record.compression == "lz4":
                    raise ValueError(f"a chunk of {size} bytes, {record.compression}")
    stream.seek(0)


# --- excerpts, and files that a crash left ----------------------------------------


@disk_errors()
def write_excerpt(folder: Path, target: Path, since: float, until: float) -> int:
    """Copy messages between two moments (Unix s); returns their number.

    From a damaged file the readable messages are copied.

    Raises:
        HopError: the disk is full or away.
    """
    excerpt = McapFile(target, Instant(0.0, since))
    copied = sum(
        _copy(path, excerpt, since, until) for path in sorted(folder.glob("*.mcap*"))
    )
    excerpt.finish()
    return copied


def finish_broken(path: Path) -> None:
    """Replace an unfinished file by its readable messages, with an index.

    It takes minutes for an hour of many robots: not for the server's own process.

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
        # The crash came before the beginning of the file was on the disk.
        _log.info("%s", error)
    except OSError as error:
        # Free the space: the disk may be full.
        rescued.unlink(missing_ok=True)
        raise HopError("disk", error.strerror or str(error)) from error
    path.unlink()


def _copy(
    source: Path, target: McapFile, since: float = 0.0, until: float = FOREVER
) -> int:
    """Copy readable messages; returns their number."""
    copied = 0
    # Missing: the open file is renamed when it is finished.
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
