"""A recording from any moment on, also while it is still written.

A file that is open has no index, but each chunk tells its first and last moment in its
head (https://mcap.dev/spec#chunk-op0x06), so that all others are passed over unread.
"""

import io
import struct
import zlib
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from typing import IO, NamedTuple

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk

from iveg.adapters.recordings.mcap_file import PADDING
from iveg.adapters.recordings.reading import read_messages
from iveg.domain.errors import DataFileError
from iveg.domain.observations import Instant

_RECORD = struct.Struct("<BQ")
_SPAN = struct.Struct("<QQ")
_MESSAGE = struct.Struct("<HIQQ")
_MAGIC_BYTES = 8
_LARGEST = 1 << 26


class ChunkPlace(NamedTuple):
    """A chunk: its first and last moment (ns), and where it is in the file."""

    first: int
    last: int
    offset: int
    size: int


class Recorded(NamedTuple):
    """A message: its topic, ``log_time`` (ns) and payload."""

    topic: str
    log_time: int
    payload: bytes


class ChunkedRecording:
    """One file.

    Args:
        path: May be open still; :meth:`refresh` finds what was added.

    Attributes:
        start: Its beginning, on both clocks.
        chunks: In the order of the file.

    Raises:
        DataFileError: it cannot be read, or no iVeg wrote it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with read_messages(path) as reading:
            self.start = reading.start
        self.chunks: list[ChunkPlace] = []
        self._topics: dict[int, str] = {}
        self._begins = _MAGIC_BYTES
        self.refresh()

    def refresh(self) -> None:
        """Find chunks that were added.  Raises DataFileError."""
        try:
            with self.path.open("rb") as stream:
                ends = stream.seek(0, io.SEEK_END)
                while self._pass(stream, ends):
                    pass
        except OSError as error:
            raise self._unusable(f"cannot be read: {error}.") from error

    def _pass(self, stream: IO[bytes], ends: int) -> bool:
        """Pass over a record; whether it was there as a whole."""
        stream.seek(self._begins)
        head = stream.read(_RECORD.size)
        if len(head) < _RECORD.size:
            return False
        opcode, size = _RECORD.unpack(head)
        begins = self._begins + _RECORD.size
        if begins + size > ends or opcode == Opcode.DATA_END:
            return False
        if opcode == Opcode.CHUNK:
            first, last = _SPAN.unpack(stream.read(_SPAN.size))
            self.chunks.append(ChunkPlace(first, last, begins, size))
        self._begins = begins + size
        return True

    @property
    def first(self) -> int:
        """Its first moment (ns)."""
        return round(self.start.wall * 1e9)

    @property
    def last(self) -> int:
        """Its last moment so far (ns)."""
        return self.chunks[-1].last if self.chunks else self.first

    def instant(self, log_time: int) -> Instant:
        """The moment on both clocks, where the wall clock was not set meanwhile.

        A monotonic clock counts nanoseconds, so that this is the very same number.
        """
        mono_ns = round(self.start.mono * 1e9) + log_time - self.first
        return Instant(mono_ns / 1e9, log_time / 1e9)

    def at(self, log_time: int) -> int:
        """The number of the last chunk that begins by then; -1: none does."""
        return bisect_right(self.chunks, log_time, key=lambda one: one.first) - 1

    def read(self, number: int) -> list[Recorded]:
        """The messages of a chunk, in their order; none where it is damaged.

        Raises:
            DataFileError: the file is away.
        """
        data = self._data(number)
        found = list(self._messages(data))
        if any(topic is None for topic, *_ in found):
            self._learn_all()
            found = list(self._messages(data))
        return [
            Recorded(topic, log_time, payload)
            for topic, log_time, payload in found
            if topic is not None and topic != PADDING.topic
        ]

    def _learn_all(self) -> None:
        """Read the channels of all chunks: one says them where it first used them."""
        for number in range(len(self.chunks)):
            for _ in self._messages(self._data(number)):
                pass

    def _data(self, number: int) -> bytes:
        place = self.chunks[number]
        if place.size > _LARGEST:
            return b""
        try:
            with self.path.open("rb") as stream:
                stream.seek(place.offset)
                body = stream.read(place.size)
            chunk = Chunk.read(ReadDataStream(io.BytesIO(body)))
            size = min(chunk.uncompressed_size, _LARGEST)
            data: bytes = zstandard.decompress(chunk.data, max_output_size=size)
        except OSError as error:
            raise self._unusable(f"cannot be read: {error}.") from error
        except Exception:
            return b""
        return data if zlib.crc32(data) == chunk.uncompressed_crc else b""

    def _messages(self, data: bytes) -> Iterator[tuple[str | None, int, bytes]]:
        begins = 0
        while begins + _RECORD.size <= len(data):
            opcode, size = _RECORD.unpack_from(data, begins)
            begins += _RECORD.size
            if opcode == Opcode.MESSAGE:
                number, _, log_time, _ = _MESSAGE.unpack_from(data, begins)
                payload = data[begins + _MESSAGE.size : begins + size]
                yield self._topics.get(number), log_time, payload
            elif opcode == Opcode.CHANNEL:
                told = Channel.read(
                    ReadDataStream(io.BytesIO(data[begins : begins + size]))
                )
                self._topics[told.id] = told.topic
            begins += size

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self.path), "", reason)
