"""An MQTT 3.1.1 broker in the process, for greenhouses without one.

It handles each packet in the call that brings it, without a task, queue or lock.  Code
in the same process may listen and publish by a call, which halves the latency of a
measure and saves a third of its CPU time.  Its limits are in ``docs/fiware.md``.
"""

import asyncio
import logging
from collections.abc import Callable
from typing import NamedTuple

from paho.mqtt.client import topic_matches_sub

from iveg.adapters import clock
from iveg.adapters.connection_caps import ConnectionCaps
from iveg.adapters.connections import ConnectionTable
from iveg.adapters.mqtt_packets import publish_packet

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
        table: The connections.
        clients: Admitted clients by client identifier.
        lines: All open connections.
    """

    def __init__(self) -> None:
        self.port = 0
        self.table = ConnectionTable(clock.mono, ConnectionCaps.on_loopback())
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

    def publish(self, topic: str, payload: bytes, qos: int, *, retain: bool) -> None:
        """Publish a message, which listeners do not get."""
        self._spread(Publication(topic, payload, qos, retain))

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
