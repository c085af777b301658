"""The embedded MQTT broker on a port: packets of clients, and the answers to them."""

import asyncio
import re
import secrets
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import lru_cache
from typing import cast

from iveg.adapters.mqtt_packets import (
    PUBACK,
    PUBLISH,
    QOS_1,
    RETAINED,
    packet_bounds,
    publish_packet,
    remaining_length,
)
from iveg.lab.embedded.mqtt_broker import (
    LARGEST_PACKET,
    BrokerClient,
    MqttBroker,
    Publication,
)

_CONNECT, _PUBREC, _PUBREL, _PUBCOMP = 0x10, 0x50, 0x62, 0x70
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
    ending = asyncio.create_task(broker.table.run(), name="mqtt-late-clients")
    try:
        yield broker
    finally:
        ending.cancel()
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
        peer = self.line.get_extra_info("peername") or ("",)
        self._place = self._broker.table.admit(peer[0], self.line.abort)
        if self._place is None:
            self.hang_up()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """The client has left; its last will is published unless it said so."""
        if self._alive is not None:
            self._alive.cancel()
        if self._place is not None:
            self._place.leave()
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
                self._refuse("packet_too_long")
            elif not body or end > len(data):
                needed = end - start
                break
            else:
                self._handle(data[start:end], body - start)
                start = end
        self._held, self._needed = bytearray(data[start:]), needed

    def _refuse(self, reason: str) -> None:
        if self._place is not None:
            self._broker.table.refused(self._place.address, reason)
        self.hang_up()

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
            elif kind == _PUBREL:
                self.line.write(bytes((_PUBCOMP, 2)) + _number(body))
            elif kind == _PINGREQ:
                self.line.write(_PINGRESP)
            elif kind == _DISCONNECT:
                self._will = None
                self.line.close()
            elif kind != PUBACK:
                raise ValueError(kind)
        except (ValueError, IndexError):
            self._refuse("unreadable")

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
        if self._place is not None:
            self._place.serve()
            self._place.vouch()
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
        if payload > len(body):
            raise ValueError(kind)
        publication = Publication(_published_topic(name), body[payload:], qos, retain)
        self._broker.receive(publication, packet if kind == PUBLISH else b"")
        if qos:
            answer = PUBACK if kind & QOS_1 else _PUBREC
            self.line.write(bytes((answer, 2)) + body[at:payload])

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
