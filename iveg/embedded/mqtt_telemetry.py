"""Fast path of telemetry through amqtt: no task, queue or lock for each message.

amqtt reads and writes through two adapters, which this module replaces.  On reading, a
plain PUBLISH of QoS 0 is handled at once; every other packet goes to amqtt.  On
writing, a client that reads too slowly misses telemetry instead of filling the memory.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable

from amqtt.adapters import ReaderAdapter, StreamWriterAdapter

_TELEMETRY = b"\x30"
"""PUBLISH, QoS 0, neither retained nor a duplicate."""
_LONGEST_LENGTH = 4
_FORBIDDEN = re.compile("^\\$|[+#\0\ufffd]")
MOST_UNSENT = 512 << 10
"""Limit of the data pending for one slow client (bytes): a fifth of a second of ten
robots' scans.  Messages to be confirmed queue behind it."""

Take = Callable[[str, bytes], Awaitable[None]]


class TelemetryReader(ReaderAdapter):  # type: ignore[misc]
    """Reads one client's packets; handles telemetry without amqtt.

    The part of a packet that was read is kept while the rest is pending, because amqtt
    cancels a wait that is longer than the client's keep-alive.

    Args:
        reader: The connection.
        take: Called with topic and payload of each telemetry message.

    Attributes:
        admitted: Whether the client has sent CONNECT and may publish.
    """

    def __init__(self, reader: asyncio.StreamReader, take: Take) -> None:
        self._reader = reader
        self._take = take
        self._head = b""
        self._held = b""
        self.admitted = False

    async def read(self, n: int = -1) -> bytes:
        """The next ``n`` bytes of packets that are not telemetry."""
        if n == -1:
            return bytes(await self._reader.read(n))
        while n > 0 and not self._held:
            packet = await self._packet()
            if not await self._is_taken(packet):
                self._held = packet
        if n > len(self._held):
            # The packet is shorter than stated; bytes of the next one must not fill it.
            short, self._held = self._held, b""
            raise asyncio.IncompleteReadError(short, n)
        part, self._held = self._held[:n], self._held[n:]
        return part

    def feed_eof(self) -> None:
        """The connection ends."""
        self._reader.feed_eof()

    async def _packet(self) -> bytes:
        while (length := _body_length(self._head)) is None:
            self._head += await self._reader.readexactly(1)
        body = await self._reader.readexactly(length)
        packet, self._head = self._head + body, b""
        return packet

    async def _is_taken(self, packet: bytes) -> bool:
        if not self.admitted or not packet.startswith(_TELEMETRY):
            return False
        body = 2
        while packet[body - 1] & 0x80:
            body += 1
        start = body + 2
        end = start + int.from_bytes(packet[body:start], "big")
        topic = packet[start:end].decode(errors="replace")
        if end > len(packet) or not topic or _FORBIDDEN.search(topic) is not None:
            # amqtt would lose its place in the stream; MQTT requires to disconnect.
            raise ConnectionResetError("a PUBLISH that nobody may send")
        await self._take(topic, packet[end:])
        return True


def _body_length(head: bytes) -> int | None:
    """Bytes after a fixed header; None while it is incomplete."""
    length = head[1:]
    if not length or (length[-1] & 0x80 and len(length) < _LONGEST_LENGTH):
        return None
    # A fifth length byte is an error that amqtt reports: it gets the head alone.
    if length[-1] & 0x80:
        return 0
    return sum((byte & 0x7F) << (7 * place) for place, byte in enumerate(length))


class BoundedWriter(StreamWriterAdapter):  # type: ignore[misc]
    """Writes to one client.

    Attributes:
        missed: Telemetry messages dropped because the client was too slow.
    """

    def __init__(self, writer: asyncio.StreamWriter) -> None:
        super().__init__(writer)
        self._transport = writer.transport
        self.missed = 0

    def write_telemetry(self, packet: bytes) -> None:
        """Send a whole packet, or nothing to a client that does not read."""
        if self._transport.get_write_buffer_size() > MOST_UNSENT:
            self.missed += 1
        else:
            self.write(packet)


def publish_packet(topic: str, payload: bytes) -> bytes:
    """One PUBLISH of QoS 0."""
    name = topic.encode()
    size = 2 + len(name) + len(payload)
    length = bytearray()
    while True:
        size, low = divmod(size, 128)
        length.append(low | (128 if size else 0))
        if not size:
            break
    return b"\x30%b%b%b%b" % (
        bytes(length),
        len(name).to_bytes(2, "big"),
        name,
        payload,
    )
