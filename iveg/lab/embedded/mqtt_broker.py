"""MQTT 3.1.1 broker in the process, for greenhouses without one.

It handles each packet in the call that brings it, without a task, queue or lock.  Code
in the same process may listen and publish by a call, which halves the latency of a
measure and saves a third of its CPU time.  It has the packets that iVeg and its robots
send; any other ends the connection.  Its limits are in ``docs/fiware.md``.
"""

import asyncio
import logging
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import cast

from paho.mqtt.client import topic_matches_sub

_log = logging.getLogger(__name__)

# --- packets ----------------------------------------------------------------------

PUBLISH, QOS_1, RETAINED = 0x30, 0x02, 0x01
"""First byte of a PUBLISH, and its flags (section 3.3.1)."""
_CONNECT, _PUBACK, _DISCONNECT = 0x10, 0x40, 0xE0
_SUBSCRIBE, _SUBACK = 0x82, 0x90
_PINGREQ, _PINGRESP = 0xC0, b"\xd0\x00"
_ACCEPTED = b"\x20\x02\x00\x00"
_MQTT_3_1_1, _WILL = b"MQTT\x04", 0x04
_LONGEST_LENGTH = 4
"""Bytes of a remaining length (section 2.2.3)."""


def packet_bounds(data: bytes, start: int) -> tuple[int, int]:
    """Begin and end of the body of the packet at ``start``.

    The end may be behind the data; both are 0 while the fixed header is incomplete.  A
    length that goes on after four bytes is an error: such a packet is the header alone.
    """
    length = shift = 0
    at = start + 1
    for byte in data[at : at + _LONGEST_LENGTH]:
        length |= (byte & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if byte < 0x80:
            return at, at + length
    return (at, at) if at == start + 1 + _LONGEST_LENGTH else (0, 0)


def publish_packet(
    topic: str, payload: bytes, packet_id: int | None = None, *, retain: bool = False
) -> bytes:
    """A PUBLISH (section 3.3): at QoS 1 with a packet identifier, at QoS 0 without."""
    name = topic.encode()
    number = b"" if packet_id is None else packet_id.to_bytes(2)
    kind = PUBLISH | (QOS_1 if number else 0) | (RETAINED if retain else 0)
    return _packet(kind, len(name).to_bytes(2) + name + number + payload)


def _packet(kind: int, body: bytes) -> bytes:
    """A packet; its length takes seven bits a byte, the lowest first."""
    head, size = bytearray((kind,)), len(body)
    while size > 127:
        head.append(size & 127 | 128)
        size >>= 7
    head.append(size)
    return bytes(head) + body


def _field(body: bytes, at: int) -> tuple[bytes, int]:
    """A field with its length before it (section 1.5.3), and the end of the field.

    Raises:
        ValueError: the packet is shorter than stated.
    """
    end = at + 2 + int.from_bytes(body[at : at + 2])
    if end > len(body):
        raise ValueError(end)
    return body[at + 2 : end], end


# --- the broker -------------------------------------------------------------------

_MOST_TOPICS = 10_000
LARGEST_PACKET = 8 << 20
"""(bytes); ``deploy/mosquitto.conf`` allows 128 KiB."""
MOST_UNSENT = 512 << 10
"""Telemetry pending for one slow client (bytes): a fifth of a second of ten robots'
scans.  Messages to be confirmed queue behind it, up to ``LARGEST_PACKET``."""
Listener = Callable[[str, bytes], None]


class MqttBroker:
    """Clients, their subscriptions and retained messages.

    Attributes:
        port: TCP port in use.
        clients: Admitted clients by client identifier.
        connections: All open connections.
    """

    def __init__(self) -> None:
        self.port = 0
        self.clients: dict[str, BrokerClient] = {}
        self.connections: set[BrokerClient] = set()
        self._listeners: list[Listener] = []
        self._retained: dict[str, tuple[bytes, int]] = {}
        self._audiences: dict[str, list[tuple[BrokerClient, int]]] = {}

    # --- code in the process ----------------------------------------------------

    def listen(self, listener: Listener) -> None:
        """Call ``listener`` with every message of clients; it must not block."""
        self._listeners.append(listener)

    def publish(self, topic: str, payload: bytes, qos: int = 0) -> None:
        """Publish a message to subscribers; listeners do not get it."""
        packet = publish_packet(topic, payload)
        for client, granted_qos in self._audience(topic):
            if granted_qos and qos:
                client.write_confirmed(topic, payload)
            # Telemetry that waits for a slow client would arrive old.
            elif client.unsent <= MOST_UNSENT:
                client.transport.write(packet)

    # --- clients ----------------------------------------------------------------

    def receive(self, topic: str, payload: bytes, qos: int, *, retain: bool) -> None:
        """Deliver a client's message."""
        for listener in self._listeners:
            try:
                listener(topic, payload)
            except Exception:
                _log.exception("a message on %s could not be taken", topic)
        self.publish(topic, payload, qos)
        if retain and payload:
            self._retained[topic] = payload, qos
        elif retain:
            self._retained.pop(topic, None)

    def admit(self, client: "BrokerClient") -> None:
        """Add a client; an older connection of the same identifier is closed."""
        older = self.clients.get(client.client_id)
        self.clients[client.client_id] = client
        if older is not None:
            # A returning client must not wait for the end of its lost connection.
            older.transport.abort()

    def leave(self, client: "BrokerClient") -> None:
        """Remove a connection that is closed."""
        self.connections.discard(client)
        if self.clients.get(client.client_id) is client:
            del self.clients[client.client_id]
        self.forget_audiences()

    def forget_audiences(self) -> None:
        """Clear the cache after a change of subscriptions."""
        self._audiences.clear()

    def retained(self, topic_filter: str) -> list[tuple[str, bytes, int]]:
        """Topic, payload and QoS of retained messages that fit a filter."""
        return [
            (topic, *message)
            for topic, message in self._retained.items()
            if topic_matches_sub(topic_filter, topic)
        ]

    def _audience(self, topic: str) -> list[tuple["BrokerClient", int]]:
        """Subscribers of a topic with their quality of service."""
        known = self._audiences.get(topic)
        if known is None:
            if len(self._audiences) >= _MOST_TOPICS:
                self._audiences.clear()
            known = self._audiences[topic] = []
            for client in self.clients.values():
                fitting = [
                    qos
                    for topic_filter, qos in client.filters.items()
                    if topic_matches_sub(topic_filter, topic)
                ]
                if fitting:
                    known.append((client, max(fitting)))
        return known


@asynccontextmanager
async def mqtt_broker(host: str, port: int) -> AsyncIterator[MqttBroker]:
    """Run a broker while the block lasts; port 0 takes a free one.

    Raises:
        OSError: the port is taken.
    """
    broker = MqttBroker()
    server = await asyncio.get_running_loop().create_server(
        lambda: BrokerClient(broker), host, port
    )
    broker.port = int(server.sockets[0].getsockname()[1])
    try:
        yield broker
    finally:
        server.close()
        for client in broker.connections:
            client.transport.abort()
        # The loop closes their sockets before it comes back here.
        await asyncio.sleep(0)


class BrokerClient(asyncio.Protocol):
    """Splits the bytes of one client into packets and answers them.

    A first packet other than CONNECT, or an unreadable packet, ends the connection.

    Args:
        broker: Gets the client's messages.

    Attributes:
        client_id: Client identifier; empty until the client is admitted.
        filters: Subscribed topic filters with their quality of service.
    """

    transport: asyncio.Transport

    def __init__(self, broker: MqttBroker) -> None:
        self.client_id = ""
        self.filters: dict[str, int] = {}
        self._broker = broker
        self._number = 0
        self._rest = b""

    @property
    def unsent(self) -> int:
        """Data that the client has not read yet (bytes)."""
        return self.transport.get_write_buffer_size()

    def write_confirmed(self, topic: str, payload: bytes) -> None:
        """Send a message at QoS 1; a client that never reads is disconnected."""
        self.transport.write(publish_packet(topic, payload, self._next_number()))
        if self.unsent > LARGEST_PACKET + MOST_UNSENT:
            self.transport.abort()

    def _next_number(self) -> int:
        """A packet identifier for a message at QoS 1."""
        self._number = self._number % 65_535 + 1
        return self._number

    # --- the connection ---------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start to serve a client."""
        self.transport = cast("asyncio.Transport", transport)
        self._broker.connections.add(self)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """Forget the client."""
        self._broker.leave(self)

    def data_received(self, data: bytes) -> None:
        """Handle complete packets; keep the rest."""
        data = self._rest + data
        start = 0
        while not self.transport.is_closing():
            body, end = packet_bounds(data, start)
            # Judged by the stated length, before the packet can fill the memory.
            if end - start > LARGEST_PACKET:
                self.transport.abort()
            elif not body or end > len(data):
                break
            else:
                try:
                    self._handle(data[start], data[body:end])
                except (ValueError, IndexError):
                    self.transport.abort()
                start = end
        self._rest = data[start:]

    # --- packets of the client --------------------------------------------------

    def _handle(self, kind: int, body: bytes) -> None:
        if not self.client_id:
            self._connect(kind, body)
        elif kind & 0xF0 == PUBLISH:
            self._publish(kind, body)
        elif kind == _SUBSCRIBE:
            self._subscribe(body)
        elif kind == _PINGREQ:
            self.transport.write(_PINGRESP)
        elif kind == _DISCONNECT:
            self.transport.close()
        elif kind != _PUBACK:
            raise ValueError(kind)

    def _connect(self, kind: int, body: bytes) -> None:
        # Keep-alive is not watched: on loopback a connection ends with its process.
        if kind != _CONNECT or body[2:7] != _MQTT_3_1_1 or body[7] & _WILL:
            raise ValueError(kind)
        client_id, _ = _field(body, 10)
        self.client_id = client_id.decode() or secrets.token_hex(8)
        self._broker.admit(self)
        self.transport.write(_ACCEPTED)

    def _publish(self, kind: int, body: bytes) -> None:
        qos, retain = kind >> 1 & 3, bool(kind & RETAINED)
        name, at = _field(body, 0)
        payload = at + (2 if qos else 0)
        if payload > len(body) or qos > 1:
            raise ValueError(kind)
        self._broker.receive(name.decode(), body[payload:], qos, retain=retain)
        if qos:
            self.transport.write(_packet(_PUBACK, body[at:payload]))

    def _subscribe(self, body: bytes) -> None:
        at, granted = 2, {}
        while at < len(body):
            name, at = _field(body, at)
            granted[name.decode()] = min(body[at], 1)
            at += 1
        if not granted:
            raise ValueError(body)
        self.filters.update(granted)
        self._broker.forget_audiences()
        self.transport.write(_packet(_SUBACK, body[:2] + bytes(granted.values())))
        for topic_filter, granted_qos in granted.items():
            for topic, payload, qos in self._broker.retained(topic_filter):
                number = self._next_number() if min(qos, granted_qos) else None
                self.transport.write(
                    publish_packet(topic, payload, number, retain=True)
                )
