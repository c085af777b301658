"""Fast path of telemetry through amqtt: no task, queue or lock for each message.

amqtt reads and writes through two adapters, which this module replaces.  On reading, a
connection is split into packets as its bytes arrive; a plain PUBLISH of QoS 0 or 1 is
handled at once, and every other packet is queued for amqtt.  On writing, a client that
reads too slowly misses telemetry instead of filling the memory.
"""

import asyncio
import re
from collections.abc import Awaitable, Callable
from functools import lru_cache
from typing import cast

from amqtt.adapters import ReaderAdapter, StreamWriterAdapter

from iveg.adapters.connections import Connection, ConnectionTable
from iveg.adapters.mqtt_packets import PUBLISH, QOS_1, packet_bounds, puback_packet

_PLAIN = (PUBLISH, PUBLISH | QOS_1)
"""PUBLISH at QoS 0 and 1, neither retained nor a duplicate."""
_FORBIDDEN = re.compile("^\\$|[+#\0\ufffd]")
LARGEST_CONNECT = 16 << 10
"""Of a client that is not admitted (bytes): user, password, last will."""
LARGEST_PACKET = 8 << 20
"""Of an admitted one (bytes); ``deploy/mosquitto.conf`` allows 128 KiB."""
MOST_UNSENT = 512 << 10
"""Limit of the data pending for one slow client (bytes): a fifth of a second of ten
robots' scans.  Messages to be confirmed queue behind it."""

Connected = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]
Take = Callable[[str, bytes, int, bytes], None]


class PacketReader(ReaderAdapter):  # type: ignore[misc]
    """Packets of one client that amqtt has to handle."""

    def __init__(self) -> None:
        self._packets: asyncio.Queue[bytes] = asyncio.Queue()
        self._held = b""

    def feed(self, packet: bytes) -> None:
        """Add a complete packet."""
        self._packets.put_nowait(packet)

    def feed_eof(self) -> None:
        """No packet comes any more."""
        self._packets.put_nowait(b"")

    async def read(self, n: int = -1) -> bytes:
        """The next ``n`` bytes of a packet; all that is left of it for -1.

        Raises:
            IncompleteReadError: the packet is shorter than stated, and bytes of the
                next one must not fill it; or the connection has ended.
        """
        held = self._held
        if n and not held:
            held = await self._packets.get()
            if not held:
                self.feed_eof()
        self._held = b""
        if n > len(held):
            raise asyncio.IncompleteReadError(held, n)
        if n >= 0:
            held, self._held = held[:n], held[n:]
        return held


class PacketProtocol(asyncio.StreamReaderProtocol):
    """Splits the bytes of one client into packets and handles its telemetry.

    Only CONNECT is passed on until the client is admitted; later packets wait.

    Args:
        connected: Serves the client until it leaves.
        take: Called with topic, payload and quality of service of each telemetry
            message, and with the whole packet if that is 0.
        table: The connections of this broker.

    Attributes:
        packets: All other packets.
    """

    def __init__(
        self, connected: Connected, take: Take, table: ConnectionTable
    ) -> None:
        super().__init__(asyncio.StreamReader(), connected)
        self._table = table
        self._place: Connection | None = None
        self.packets = PacketReader()
        self._take = take
        self._line: asyncio.Transport | None = None
        self._held = bytearray()
        self._needed = 0
        self._holding = False
        self._confirming: BoundedWriter | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start to serve a client."""
        self._line = line = cast("asyncio.Transport", transport)
        peer = line.get_extra_info("peername") or ("",)
        self._place = self._table.admit(peer[0], line.abort)
        super().connection_made(transport)
        if self._place is None:
            line.abort()

    def admit(self, writer: "BoundedWriter") -> None:
        """Handle what the client has sent since CONNECT; it has got its CONNACK."""
        self._confirming = writer
        self._holding = False
        if self._place is not None:
            self._place.serve()
            self._place.vouch()
        self.data_received(b"")
        if self._line is not None and not self._holding:
            self._line.resume_reading()

    def data_received(self, data: bytes) -> None:
        """Handle complete packets; keep an incomplete one."""
        if self._held:
            self._held += data
            if len(self._held) < self._needed:
                return
            data = bytes(self._held)
        start = needed = 0
        while not self._holding:
            body, end = packet_bounds(data, start)
            if body and end - start > self._largest:
                self._refuse()
                return
            if not body or end > len(data):
                needed = end - start
                break
            self._pass_on(data[start:end], body - start)
            start = end
        self._held, self._needed = bytearray(data[start:]), needed

    def eof_received(self) -> bool | None:
        """End the packets of a client that closes its side."""
        self.packets.feed_eof()
        return super().eof_received()

    def connection_lost(self, exc: Exception | None) -> None:
        """End the packets of a lost client."""
        self._line = None
        if self._place is not None:
            self._place.leave()
        self.packets.feed_eof()
        super().connection_lost(exc)

    @property
    def _largest(self) -> int:
        return LARGEST_CONNECT if self._confirming is None else LARGEST_PACKET

    def _refuse(self) -> None:
        """End a client that announces a packet beyond the limit."""
        self._held.clear()
        self._needed = 0
        if self._place is not None:
            self._table.refused(self._place.address, "packet_too_long")
        if self._line is not None:
            self._line.abort()

    def _pass_on(self, packet: bytes, body: int) -> None:
        writer = self._confirming
        if writer is None or packet[0] not in _PLAIN:
            self.packets.feed(packet)
            if writer is None:
                self._hold()
            return
        qos = packet[0] >> 1 & 1
        end = body + 2 + int.from_bytes(packet[body : body + 2], "big")
        topic = _topic(packet[body + 2 : end])
        if not topic or end + 2 * qos > len(packet):
            # MQTT requires to disconnect; amqtt would lose its place in the stream.
            self.packets.feed_eof()
            self._hold()
            return
        self._take(topic, packet[end + 2 * qos :], qos, b"" if qos else packet)
        if qos:
            writer.write(puback_packet(packet[end : end + 2]))

    def _hold(self) -> None:
        self._holding = True
        if self._line is not None:
            self._line.pause_reading()


@lru_cache(maxsize=2048)
def _topic(name: bytes) -> str:
    """Name of a topic; empty for one that no client may publish on."""
    topic = name.decode(errors="replace")
    return "" if _FORBIDDEN.search(topic) else topic


class BoundedWriter(StreamWriterAdapter):  # type: ignore[misc]
    """Writes to one client.

    Attributes:
        protocol: Receiver of the same connection.
    """

    def __init__(self, writer: asyncio.StreamWriter, protocol: PacketProtocol) -> None:
        super().__init__(writer)
        self.protocol = protocol
        self._line = writer.transport

    def write_telemetry(self, packet: bytes) -> None:
        """Send a whole packet, or nothing to a client that does not read."""
        if self._line.get_write_buffer_size() <= MOST_UNSENT and not self.is_closed:
            self._line.write(packet)
