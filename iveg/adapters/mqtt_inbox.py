"""Reader of MQTT: one call reads the whole buffer, and of telemetry only the newest.

The client library reads a packet's parts one by one from the socket, one packet a turn
of the loop, and makes two tasks for each message.  While the loop has much else to do,
that is slower than a fleet sends: messages on the wire grow old, and robots' answers to
a STOP behind them.  Here messages and PUBACKs are read; the rest is left to it.

This file and ``mqtt_outbox`` alone touch private parts of aiomqtt and paho
(docs/decisions/0005-past-the-mqtt-library.md).
"""

import asyncio
import socket
import ssl
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import aiomqtt
from paho.mqtt import client as paho

from iveg.adapters.mqtt_packets import (
    DUPLICATE,
    PUBACK,
    PUBLISH,
    QOS_1,
    RETAINED,
    packet_bounds,
)

READ_AHEAD = 1 << 20
"""Taken from the wire in one call (bytes): more than comes in a long turn of the loop.

What is passed over has to be what is old, and the oldest waits in the socket.
"""
_TELEMETRY, _CONFIRMED = PUBLISH, PUBLISH | QOS_1
"""First bytes of a PUBLISH at QoS 0 and at QoS 1, without flags."""


@dataclass(frozen=True, slots=True)
class Qos1Message:
    """A message at QoS 1, and its packet identifier."""

    topic: str
    payload: bytes
    packet_id: int


@dataclass(slots=True)
class Arrived:
    """What has come, sorted.

    Attributes:
        telemetry: The newest payload at QoS 0 by topic.
        passed_over: How many older ones of a topic there were.
        qos1: Everything that was sent at QoS 1, in order.
        pubacks: Packet identifiers of our own messages that the broker has.
        others: Packets that are the library's to read.
    """

    telemetry: dict[str, bytes] = field(default_factory=dict)
    passed_over: dict[str, int] = field(default_factory=dict)
    qos1: list[Qos1Message] = field(default_factory=list)
    pubacks: list[int] = field(default_factory=list)
    others: bytes = b""


OnArrived = Callable[[Arrived], None]


class InboxClient(aiomqtt.Client):
    """A client that reads the whole buffer, and then rests.

    A fleet sends hundreds of messages in a second, and each event costs as much as
    reading one of them: what comes within ``apart_s`` is read together.

    Args:
        on_arrived: Told what has come.  It speaks MQTT 3.1.1.
        apart_s: Least time between two readings (s); 0: whenever something comes.
    """

    def __init__(
        self, *args: Any, on_arrived: OnArrived, apart_s: float = 0.0, **kwargs: Any
    ) -> None:
        super().__init__(*args, protocol=aiomqtt.ProtocolVersion.V311, **kwargs)
        self._on_arrived = on_arrived
        self._apart_s = apart_s
        # Who waits for the end hears why; where nobody does, nobody is missing it.
        self._disconnected.add_done_callback(_retrieve)

    async def lost(self) -> None:
        """Wait for the end of the connection.

        Raises:
            MqttError: it has ended.
        """
        async for _ in self.messages:
            """Nothing that anybody subscribes to comes this way."""

    def _on_socket_open(self, client: paho.Client, userdata: object, sock: Any) -> None:
        # Paho reads from this; it has no public way to say which socket.
        line = client._sock = ReadAhead(sock, self._on_arrived)
        super()._on_socket_open(client, userdata, line)
        # In place of the reader that has just been asked for, from the same thread.
        self._loop.call_soon_threadsafe(self._listen, line)

    def _listen(self, line: "ReadAhead") -> None:
        """Read as soon as something comes."""
        self._loop.add_reader(line.fileno(), self._read, line)

    def _read(self, line: "ReadAhead") -> None:
        """Read what is there; then rest, or wait for an event if there was nothing."""
        try:
            has_come = line.read_ahead()
            while line is self._client._sock and line.pending():
                self._client.loop_read()
        except Exception as error:  # as aiomqtt: the connection broke
            if not self._disconnected.done():
                self._disconnected.set_exception(error)
            return
        if line is not self._client._sock:
            return
        if not has_come:
            self._listen(line)
        elif self._apart_s:
            self._loop.remove_reader(line.fileno())
            self._loop.call_later(self._apart_s, self._read_again, line)

    def _read_again(self, line: "ReadAhead") -> None:
        """After a rest: the connection may have ended meanwhile."""
        if line is self._client._sock:
            self._read(line)


def _retrieve(ended: asyncio.Future[Any]) -> None:
    """Look at an exception, so that asyncio does not complain that nobody did."""
    if not ended.cancelled():
        ended.exception()


class ReadAhead:
    """A socket whose bytes are taken in large pieces, one an event.

    One only, so that a flood from the broker leaves the loop its other work.
    """

    def __init__(self, inner: socket.socket, on_arrived: OnArrived) -> None:
        self._inner = inner
        self._tell = on_arrived
        self._begun = b""
        """Of a packet that is not whole yet."""
        self._held = memoryview(b"")
        self._has_ended = False

    def __getattr__(self, name: str) -> Any:
        """Everything else is the socket's own."""
        return getattr(self._inner, name)

    def pending(self) -> bool:
        """Whether the library has something to read: its packets, or the end."""
        return self._has_ended or bool(self._held)

    def read_ahead(self) -> bool:
        """Take what has come from the wire; whether anything had, or it has ended."""
        came = self._came()
        if came is None:
            return False
        self._has_ended = not came
        arrived, self._begun = sort_packets(self._begun + came)
        self._held = memoryview(arrived.others)
        self._tell(arrived)
        return True

    def recv(self, size: int) -> bytes:
        """Up to ``size`` bytes of packets that are the library's; none at the end.

        Raises:
            BlockingIOError: nothing is there for now.
        """
        if not self.pending():
            raise BlockingIOError
        part, self._held = self._held[:size], self._held[size:]
        return bytes(part)

    def _came(self) -> bytes | None:
        """What is on the wire: None where nothing is, no bytes where it has ended."""
        inner = self._inner
        try:
            came = inner.recv(READ_AHEAD)
        except (BlockingIOError, ssl.SSLWantReadError, ssl.SSLWantWriteError):
            return None
        except OSError:
            return b""
        # There is no event for data that is decrypted already.
        while came and isinstance(inner, ssl.SSLSocket) and (ahead := inner.pending()):
            came += inner.recv(ahead)
        return came


def sort_packets(read: bytes) -> tuple[Arrived, bytes]:
    """Tell messages and PUBACKs from other packets.

    A reader that falls behind must not read ever older news: of a topic's telemetry
    (QoS 0) the newest is kept.  Of what was sent at QoS 1 (orders, answers, safety
    reports) all is.

    Returns:
        What has come, and what was read of a packet that is not whole yet.
    """
    arrived, others = Arrived(), []
    place = 0
    while (found := _packet_at(read, place)) is not None:
        body, end = found
        if not _is_ours(arrived, read, place, body, end):
            others.append(read[place:end])
        place = end
    arrived.others = b"".join(others)
    return arrived, read[place:]


def _is_ours(arrived: Arrived, read: bytes, place: int, body: int, end: int) -> bool:
    kind, head = read[place], int.from_bytes(read[body : body + 2], "big")
    if kind == PUBACK and end == body + 2:
        arrived.pubacks.append(head)
        return True
    name = body + 2 + head
    if kind & ~RETAINED == _TELEMETRY and name <= end:
        topic = read[body + 2 : name].decode(errors="replace")
        if topic in arrived.telemetry:
            older = arrived.passed_over.get(topic, 0)
            arrived.passed_over[topic] = older + 1
        arrived.telemetry[topic] = read[name:end]
        return True
    if kind & ~(RETAINED | DUPLICATE) == _CONFIRMED and name + 2 <= end:
        topic = read[body + 2 : name].decode(errors="replace")
        number = int.from_bytes(read[name : name + 2], "big")
        arrived.qos1.append(Qos1Message(topic, read[name + 2 : end], number))
        return True
    return False


def _packet_at(read: bytes, place: int) -> tuple[int, int] | None:
    """Where the body of the packet begins and ends; None where it is not whole.

    A length of more than four bytes is nobody's: the library hangs up on it.
    """
    body, end = packet_bounds(read, place)
    if not body or end > len(read):
        return None
    if end == body and read[body - 1] >= 0x80:
        return body, len(read)
    return body, end
