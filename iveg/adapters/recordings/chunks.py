"""A recording from any moment on, also while it is still written.

A finished file ends with an index of its chunks and channels.  One that is open has
none, but each chunk tells its first and last moment in its head, and the records behind
it which channels it has (https://mcap.dev/spec#records), so that all others are passed
over unread.
"""

import io
import os
import struct
import zlib
from bisect import bisect_right
from collections.abc import Collection, Iterator
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
_CHUNK_INDEX = struct.Struct("<QQQQ")
_FOOTER = struct.Struct("<BQQQI8s")
_NUMBER = struct.Struct("<H")
_MESSAGE = struct.Struct("<HIQQ")
_MAGIC = b"\x89MCAP0\r\n"
_WINDOW = 1 << 14
"""Read at once of what is passed over: an index behind a chunk fits."""
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

    Raises:
        DataFileError: it cannot be read, or no iVeg wrote it.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with read_messages(path) as reading:
            self.start = reading.start
        self._chunks: list[ChunkPlace] = []
        self._topics: dict[int, str] = {}
        self._first_in: dict[int, int] = {}
        """Number of the first chunk with messages of a channel; of an open file."""
        self._begins = len(_MAGIC)
        self._is_known = False

    def refresh(self) -> None:
        """Look for chunks that were added, when they are asked for."""
        self._is_known = False

    @property
    def chunks(self) -> list[ChunkPlace]:
        """Those that are there as a whole, in the order of the file.

        Raises:
            DataFileError: the file is away.
        """
        if not self._is_known:
            try:
                with self.path.open("rb") as stream:
                    if self._chunks or not self._read_index(stream):
                        self._pass_over(stream)
            except (OSError, struct.error) as error:
                raise self._unusable(f"cannot be read: {error}.") from error
            self._is_known = True
        return self._chunks

    # --- where what is ------------------------------------------------------------

    def _read_index(self, stream: IO[bytes]) -> bool:
        """Read the index at the end of a finished file; whether it is whole."""
        ends = stream.seek(0, io.SEEK_END) - _FOOTER.size
        if ends < self._begins:
            return False
        stream.seek(ends)
        footer = _FOOTER.unpack(stream.read(_FOOTER.size))
        opcode, _, begins, _, crc, magic = footer
        if opcode != Opcode.FOOTER or magic != _MAGIC or not 0 < begins <= ends:
            return False
        stream.seek(begins)
        summary = stream.read(ends - begins)
        computed = zlib.crc32(
            _FOOTER.pack(*footer)[: -len(_MAGIC) - 4], zlib.crc32(summary)
        )
        if crc != computed:
            return False
        head = _RECORD.size
        for opcode, body, size in _records(summary):
            if opcode == Opcode.CHUNK_INDEX:
                first, last, offset, whole = _CHUNK_INDEX.unpack_from(summary, body)
                place = ChunkPlace(first, last, offset + head, whole - head)
                self._chunks.append(place)
            elif opcode == Opcode.CHANNEL:
                self._learn(summary[body : body + size])
        return True

    def _pass_over(self, stream: IO[bytes]) -> None:
        """Find chunks by the heads of all records, from where it ended before."""
        ends = stream.seek(0, io.SEEK_END)
        window, begun = b"", 0
        while self._begins + _RECORD.size <= ends:
            at = self._begins - begun
            if at + _RECORD.size + _SPAN.size > len(window):
                begun, at = self._begins, 0
                window = os.pread(stream.fileno(), _WINDOW, begun)
            opcode, size = _RECORD.unpack_from(window, at)
            if self._begins + _RECORD.size + size > ends or opcode == Opcode.DATA_END:
                return
            at += _RECORD.size
            if opcode == Opcode.CHUNK:
                first, last = _SPAN.unpack_from(window, at)
                begins = self._begins + _RECORD.size
                self._chunks.append(ChunkPlace(first, last, begins, size))
            elif opcode == Opcode.MESSAGE_INDEX:
                (number,) = _NUMBER.unpack_from(window, at)
                self._first_in.setdefault(number, len(self._chunks) - 1)
            self._begins += _RECORD.size + size

    @property
    def first(self) -> int:
        """Its first moment (ns)."""
        return round(self.start.wall * 1e9)

    @property
    def last(self) -> int:
        """Its last moment so far (ns)."""
        return self.chunks[-1].last if self.chunks else self.first

    def instant(self, log_time: int) -> Instant:
        """The moment on both clocks.

        A monotonic clock counts nanoseconds, so that this is the very same number.
        """
        mono_ns = round(self.start.mono * 1e9) + log_time - self.first
        return Instant(mono_ns / 1e9, log_time / 1e9)

    def at(self, log_time: int) -> int:
        """The number of the last chunk that begins by then; -1: none does."""
        return bisect_right(self.chunks, log_time, key=lambda one: one.first) - 1

    # --- what is in a chunk -------------------------------------------------------

    def read(self, number: int) -> list[Recorded]:
        """The messages of a chunk, in their order; none where it is damaged.

        Raises:
            DataFileError: the file is away.
        """
        found = list(self._messages(self._data(self.chunks[number])))
        self._find_out({channel for channel, *_ in found} - self._topics.keys())
        topics = self._topics
        return [
            Recorded(topics[channel], log_time, payload)
            for channel, log_time, payload in found
            if topics.get(channel, PADDING.topic) != PADDING.topic
        ]

    def _find_out(self, unknown: Collection[int]) -> None:
        """Learn channels where a file that is open says them: before their first use.

        That is in the chunk of the message, or in the one before, which it filled.
        """
        for channel in unknown:
            used = self._first_in.get(channel, 0)
            for number in (used, used - 1):
                if number >= 0 and channel not in self._topics:
                    for _ in self._messages(self._data(self.chunks[number])):
                        pass

    def _data(self, place: ChunkPlace) -> bytes:
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

    def _messages(self, data: bytes) -> Iterator[tuple[int, int, bytes]]:
        for opcode, body, size in _records(data):
            if opcode == Opcode.MESSAGE:
                channel, _, log_time, _ = _MESSAGE.unpack_from(data, body)
                yield channel, log_time, data[body + _MESSAGE.size : body + size]
            elif opcode == Opcode.CHANNEL:
                self._learn(data[body : body + size])

    def _learn(self, channel: bytes) -> None:
        record = Channel.read(ReadDataStream(io.BytesIO(channel)))
        self._topics[record.id] = record.topic

    def _unusable(self, reason: str) -> DataFileError:
        return DataFileError(str(self.path), "", reason)


def _records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Opcode, beginning and size of the body of each record that is whole."""
    begins, head = 0, _RECORD.size
    while begins + head <= len(data):
        opcode, size = _RECORD.unpack_from(data, begins)
        begins += head
        if begins + size > len(data):
            return
        yield opcode, begins, size
        begins += size
