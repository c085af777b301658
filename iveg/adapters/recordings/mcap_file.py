"""One MCAP file (https://mcap.dev/spec), compressed in chunks, with an index."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import orjson
from mcap.writer import CompressionType, Writer

from iveg import __version__
from iveg.domain.observations import Instant

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
        """The same at a time of this file's own (ns)."""
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
