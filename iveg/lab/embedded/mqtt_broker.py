"""MQTT 3.1.1 broker in the process, for greenhouses without one.

It handles each packet in the call that brings it, without a task, queue or lock.  Code
in the same process may listen and publish by a call, which halves the latency of a
measure and saves a third of its CPU time.  Its limits are in ``docs/fiware.md``.
"""

import asyncio
import logging
import re
import secrets
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import lru_cache
from typing import NamedTuple, cast

from paho.mqtt.client import topic_matches_sub

from iveg.lab.embedded.mqtt_packets import (
    PUBACK,
    PUBLISH,
    RETAINED,
    packet_bounds,
    publish_packet,
    remaining_length,
)

_log = logging.getLogger(__name__)
_MOST_TOPICS = 10_000
_MOST_NUMBERS = 65_535
LARGEST_PACKET = 8 << 20
"""Of an admitted one (bytes); ``deploy/mosquitto.conf`` allows 128 KiB."""
MOST_UNSENT = 512 << 10
"""Telemetry pending for one slow client (bytes): a fifth of a second of ten robots'
scans.  Messages to be confirmed queue behind it, up to ``LARGEST_PACKET``."""
Listener = Callable[[str, bytes], None]


class Publication(NamedTuple):
    """A message that a client or code in the process publishes."""

    topic: str
    payload: bytes
    qos: int
    retain: bool


class BrokerClient:
    """One client: its subscriptions, and what is sent to it.

    Attributes:
        client_id: Client identifier; empty until the client is admitted.
        filters: Subscribed topic filters with their quality of service.
    """

    line: asyncio.Transport

    def __init__(self) -> None:
        self.client_id = ""
        self.filters: dict[str, int] = {}
        self._number = 0

    def hang_up(self) -> None:
        """Close the connection at once."""
        self.line.abort()

    @property
    def unsent(self) -> int:
        """Data that the client has not read yet (bytes)."""
        return self.line.get_write_buffer_size()

    def wanted_qos(self, topic: str) -> int | None:
        """Quality of service of the subscriptions to a topic; None without one."""
        fitting = [
            qos
            for topic_filter, qos in self.filters.items()
            if topic_matches_sub(topic_filter, topic)
        ]
        return max(fitting, default=None)

    def write_telemetry(self, packet: bytes) -> None:
        """Send a whole packet, or nothing to a client that does not read."""
        if self.unsent <= MOST_UNSENT:
            self.line.write(packet)

    def write_confirmed(self, topic: str, payload: bytes) -> None:
        """Send a message at QoS 1; a client that never reads is disconnected."""
        self.line.write(publish_packet(topic, payload, self.next_number()))
        if self.unsent > LARGEST_PACKET + MOST_UNSENT:
            self.hang_up()

    def next_number(self) -> int:
        """A packet identifier for a message at QoS 1."""
        self._number = self._number % _MOST_NUMBERS + 1
        return self._number


class MqttBroker:
    """Clients, their subscriptions and retained messages.

    Attributes:
        port: TCP port in use.
        clients: Admitted clients by client identifier.
        lines: All open connections.
    """

    def __init__(self) -> None:
        self.port = 0
        self.clients: dict[str, BrokerClient] = {}
        self.lines: set[BrokerClient] = set()
        self._listeners: list[Listener] = []
        self._retained: dict[str, Publication] = {}
        self._known_audience: dict[str, tuple[tuple[BrokerClient, int], ...]] = {}

    async def close(self) -> None:
        """Disconnect every client."""
        for line in self.lines:
            line.hang_up()
        # The loop closes their sockets before it comes back here.
        await asyncio.sleep(0)

    # --- code in the process ----------------------------------------------------

    def listen(self, listener: Listener) -> None:
        """Call ``listener`` with every message of clients; it must not block."""
        self._listeners.append(listener)

    def publish(self, topic: str, payload: bytes) -> None:
        """Publish a message at QoS 0, which listeners do not get."""
        self._spread(Publication(topic, payload, 0, retain=False))

    # --- clients ----------------------------------------------------------------

    def receive(self, publication: Publication, packet: bytes = b"") -> None:
        """Deliver a client's message.

        Args:
            publication: The message.
            packet: Its PUBLISH, where that is what subscribers at QoS 0 get.
        """
        for listener in self._listeners:
            try:
                listener(publication.topic, publication.payload)
            except Exception:
                _log.exception("a message on %s could not be taken", publication.topic)
        self._spread(publication, packet)

    def admit(self, line: BrokerClient) -> None:
        """Add a client; an older connection of the same identifier is closed."""
        older = self.clients.get(line.client_id)
        self.clients[line.client_id] = line
        if older is not None:
            older.hang_up()

    def leave(self, line: BrokerClient) -> None:
        """Remove a connection that is closed."""
        self.lines.discard(line)
        if self.clients.get(line.client_id) is line:
            del self.clients[line.client_id]
        self.forget_audience()

    def forget_audience(self) -> None:
        """Clear the cache after a change of subscriptions."""
        self._known_audience.clear()

    def retained(self, topic_filter: str) -> list[Publication]:
        """Retained messages that fit a filter."""
        return [
            one
            for topic, one in self._retained.items()
            if topic_matches_sub(topic_filter, topic)
        ]

    def _spread(self, publication: Publication, packet: bytes = b"") -> None:
        topic, payload, qos, retain = publication
        for line, wanted in self._audience(topic):
            if wanted and qos:
                line.write_confirmed(topic, payload)
            else:
                packet = packet or publish_packet(topic, payload)
                line.write_telemetry(packet)
        if retain and payload:
            self._retained[topic] = publication
        elif retain:
            self._retained.pop(topic, None)

    def _audience(self, topic: str) -> tuple[tuple[BrokerClient, int], ...]:
        """Subscribers of a topic with their quality of service."""
        known = self._known_audience.get(topic)
        if known is None:
            if len(self._known_audience) >= _MOST_TOPICS:
                self._known_audience.clear()
            wanted = {line: line.wanted_qos(topic) for line in self.clients.values()}
            known = self._known_audience[topic] = tuple(
                (line, qos) for line, qos in wanted.items() if qos is not None
            )
        return known


_CONNECT = 0x10
_SUBSCRIBE, _SUBACK, _UNSUBSCRIBE, _UNSUBACK = 0x82, 0x90, 0xA2, 0xB0
_PINGREQ, _DISCONNECT = 0xC0, 0xE0
_PINGRESP = b"\xd0\x00"
_ACCEPTED, _WRONG_VERSION = b"\x20\x02\x00\x00", b"\x20\x02\x00\x01"
_MQTT_3_1_1 = b"MQTT\x04"
_REFUSED_FILTER = 0x80
_FILTER = re.compile(r"#|(\+|[^+#/\0]*)(/(\+|[^+#/\0]*))*(/#)?")
_FORBIDDEN = re.compile("^\\$|[+#\0\ufffd]")
LARGEST_CONNECT = 16 << 10
"""Of a client that is not admitted (bytes): user, password, last will."""


@asynccontextmanager
async def mqtt_broker(host: str, port: int) -> AsyncIterator[MqttBroker]:
    """Run a broker while the block lasts; port 0 takes a free one.

    Raises:
        OSError: the port is taken.
    """
    broker = MqttBroker()
    server = await asyncio.get_running_loop().create_server(
        lambda: _ClientLine(broker), host, port
    )
    broker.port = int(server.sockets[0].getsockname()[1])
    try:
        yield broker
    finally:
        server.close()
        await broker.close()


class _ClientLine(BrokerClient, asyncio.Protocol):
    """Splits the bytes of one client into packets and answers them.

    Anything but CONNECT at first, and what cannot be read, ends the connection.

    Args:
        broker: Gets the client's messages.
    """

    def __init__(self, broker: MqttBroker) -> None:
        super().__init__()
        self._broker = broker
        self._will: Publication | None = None
        self._held = bytearray()
        self._needed = 0
        self._keep_alive_s = self._heard_at = 0.0
        self._alive: asyncio.TimerHandle | None = None

    # --- the connection ---------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start to serve a client."""
        self.line = cast("asyncio.Transport", transport)
        self._broker.lines.add(self)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """The client has left; its last will is published unless it said so."""
        if self._alive is not None:
            self._alive.cancel()
        self._broker.leave(self)
        if self._will is not None:
            self._broker.receive(self._will)

    def data_received(self, data: bytes) -> None:
        """Handle complete packets; keep the rest."""
        self._heard_at = asyncio.get_running_loop().time()
        if self._held:
            self._held += data
            if len(self._held) < self._needed:
                return
            data = bytes(self._held)
        start = needed = 0
        while not self.line.is_closing():
            body, end = packet_bounds(data, start)
            largest = LARGEST_PACKET if self.client_id else LARGEST_CONNECT
            if body and end - start > largest:
                self.hang_up()
            elif not body or end > len(data):
                needed = end - start
                break
            else:
                self._handle(data[start:end], body - start)
                start = end
        self._held, self._needed = bytearray(data[start:]), needed

    # --- packets of the client --------------------------------------------------

    def _handle(self, packet: bytes, start: int) -> None:
        """Handle one packet whose body begins at ``start``."""
        kind, body = packet[0], packet[start:]
        try:
            if not self.client_id:
                self._connect(kind, body)
            elif kind & 0xF0 == PUBLISH:
                self._publish(packet, body)
            elif kind == _SUBSCRIBE:
                self._subscribe(body)
            elif kind == _UNSUBSCRIBE:
                self._unsubscribe(body)
            elif kind == _PINGREQ:
                self.line.write(_PINGRESP)
            elif kind == _DISCONNECT:
                self._will = None
                self.line.close()
            elif kind != PUBACK:
                raise ValueError(kind)
        except (ValueError, IndexError):
            self.hang_up()

    def _connect(self, kind: int, body: bytes) -> None:
        if kind != _CONNECT:
            raise ValueError(kind)
        if body[2:7] != _MQTT_3_1_1:
            self.line.write(_WRONG_VERSION)
            self.line.close()
            return
        flags, keep_alive_s = body[7], int.from_bytes(body[8:10])
        client_id, at = _part(body, 10)
        if flags & 0x04:
            topic, at = _part(body, at)
            payload, at = _part(body, at)
            qos, retain = flags >> 3 & 3, bool(flags & 0x20)
            self._will = Publication(_published_topic(topic), payload, qos, retain)
        self.client_id = client_id.decode() or secrets.token_hex(8)
        self._broker.admit(self)
        self.line.write(_ACCEPTED)
        self._keep_alive_s = 1.5 * keep_alive_s
        if keep_alive_s:
            self._check_alive()

    def _check_alive(self) -> None:
        """Disconnect a client that is silent for too long (section 3.1.2.10)."""
        loop = asyncio.get_running_loop()
        left_s = self._heard_at + self._keep_alive_s - loop.time()
        if left_s <= 0:
            self.hang_up()
        else:
            self._alive = loop.call_later(left_s, self._check_alive)

    def _publish(self, packet: bytes, body: bytes) -> None:
        kind = packet[0]
        qos, retain = kind >> 1 & 3, bool(kind & RETAINED)
        name, at = _part(body, 0)
        payload = at + (2 if qos else 0)
        if payload > len(body) or qos > 1:
            raise ValueError(kind)
        publication = Publication(_published_topic(name), body[payload:], qos, retain)
        self._broker.receive(publication, packet if kind == PUBLISH else b"")
        if qos:
            self.line.write(bytes((PUBACK, 2)) + body[at:payload])

    def _subscribe(self, body: bytes) -> None:
        answer, at, granted = bytearray(_number(body)), 2, {}
        while at < len(body):
            name, at = _part(body, at)
            topic_filter, qos = name.decode(), min(body[at], 1)
            at += 1
            if topic_filter and _FILTER.fullmatch(topic_filter):
                granted[topic_filter] = qos
                answer.append(qos)
            else:
                answer.append(_REFUSED_FILTER)
        self.filters.update(granted)
        self._broker.forget_audience()
        self.line.write(bytes((_SUBACK,)) + remaining_length(len(answer)) + answer)
        for topic_filter, wanted in granted.items():
            for topic, payload, qos, _ in self._broker.retained(topic_filter):
                number = self.next_number() if min(qos, wanted) else None
                self.line.write(publish_packet(topic, payload, number, retain=True))

    def _unsubscribe(self, body: bytes) -> None:
        answer, at = bytes((_UNSUBACK, 2)) + _number(body), 2
        while at < len(body):
            name, at = _part(body, at)
            self.filters.pop(name.decode(), None)
        self._broker.forget_audience()
        self.line.write(answer)


def _number(body: bytes) -> bytes:
    """The packet identifier that a body begins with.

    Raises:
        ValueError: the body is too short for one.
    """
    if len(body) < 2:
        raise ValueError(body)
    return body[:2]


def _part(body: bytes, at: int) -> tuple[bytes, int]:
    """A field with its length before it (section 1.5.3), and where it ends.

    Raises:
        ValueError: the packet is shorter than stated.
    """
    end = at + 2 + int.from_bytes(body[at : at + 2])
    if end > len(body):
        raise ValueError(end)
    return body[at + 2 : end], end


@lru_cache(maxsize=2048)
def _published_topic(name: bytes) -> str:
    """Name of a topic.

    Raises:
        ValueError: one that no client may publish on.
    """
    topic = name.decode(errors="replace")
    if not topic or _FORBIDDEN.search(topic):
        raise ValueError(topic)
    return topic
