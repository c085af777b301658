"""Writing MQTT: together and at once.

The client library's ``publish`` makes an event, a task and two tables for each message
and takes three turns of the loop, which is most of the cost of a robot's telemetry.
Nobody confirms messages at QoS 0, so here they are written together, at once, and wait
only while the socket is full; those at QoS 1 wait for their PUBACKs and nothing else.
"""

import asyncio
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import aiomqtt

from iveg.adapters.mqtt_inbox import Arrived, InboxClient, OnArrived
from iveg.adapters.mqtt_packets import puback_packet, publish_packet

_UNTOLD = 0
_MOST_NUMBERS = 65_535


@dataclass(slots=True)
class _Batch:
    """Messages at QoS 1 that were sent together, by packet identifier."""

    done: asyncio.Future[None]
    missing: set[int] = field(default_factory=set)

    def acknowledge(self, number: int) -> None:
        self.missing.discard(number)
        if not self.missing and not self.done.done():
            self.done.set_result(None)


class OutboxClient(InboxClient):
    """A client with a short way out, which waits only for a full socket.

    Args:
        on_arrived: Told what has come; messages at QoS 1 are acknowledged afterwards.
    """

    def __init__(self, *args: object, on_arrived: OnArrived, **kwargs: Any) -> None:
        super().__init__(*args, on_arrived=self._take_in, **kwargs)
        self._hand_over = on_arrived
        self._awaited: dict[int, _Batch] = {}
        self._number = 0
        self._sending = False
        self._room = asyncio.Event()
        self._room.set()

    def send(self, messages: Iterable[tuple[str, bytes]]) -> None:
        """Write these at QoS 0, as far as the socket takes them."""
        self._put(
            b"".join(publish_packet(topic, payload) for topic, payload in messages)
        )

    async def confirmed(
        self,
        messages: Iterable[tuple[str, bytes]],
        within_s: float,
        *,
        retain: bool = False,
    ) -> None:
        """Send these together at QoS 1; return when the broker has all of them.

        Raises:
            MqttError: not connected, or a PUBACK is missing after ``within_s``.
        """
        if self._client.socket() is None:
            raise aiomqtt.MqttError("not connected")
        batch = _Batch(self._loop.create_future())
        try:
            self._put(
                b"".join(
                    publish_packet(
                        topic, payload, self._number_for(batch), retain=retain
                    )
                    for topic, payload in messages
                )
            )
            async with asyncio.timeout(within_s):
                await batch.done
        except TimeoutError as error:
            raise aiomqtt.MqttError(f"no PUBACK within {within_s:g} s") from error
        finally:
            for number in batch.missing:
                del self._awaited[number]

    def _number_for(self, batch: "_Batch") -> int:
        number = self._free_number()
        self._awaited[number] = batch
        batch.missing.add(number)
        return number

    def _free_number(self) -> int:
        """Paho numbers its own packets, but has none under way: it subscribes first."""
        self._number = self._number % _MOST_NUMBERS + 1
        while self._number in self._awaited:
            self._number = self._number % _MOST_NUMBERS + 1
        return self._number

    def _take_in(self, arrived: Arrived) -> None:
        for number in arrived.pubacks:
            batch = self._awaited.pop(number, None)
            if batch is not None:
                batch.acknowledge(number)
        self._hand_over(arrived)
        if arrived.qos1:
            numbers = (message.packet_id.to_bytes(2) for message in arrived.qos1)
            self._put(b"".join(map(puback_packet, numbers)))

    def _put(self, packets: bytes) -> None:
        packets = packets[self._written_at_once(packets) :]
        if not packets:
            return
        self._sending = True
        try:
            # Queued behind what waits, under no command that paho knows: it has nobody
            # to tell that these were written, and its public way costs five times this.
            self._client._packet_queue(_UNTOLD, packets, 0, 0)
            self._write()
        finally:
            self._sending = False

    def _written_at_once(self, packets: bytes) -> int:
        """How many bytes the socket took; paho's queue looks at all that goes wrong."""
        sock = self._client.socket()
        if sock is None or self._client.want_write():
            return 0
        try:
            return int(sock.send(packets))
        except OSError:
            return 0

    async def written(self) -> None:
        """Return once the socket has taken everything."""
        await self._room.wait()

    def _on_socket_register_write(self, *_: object) -> None:
        """Paho has something to write; it may say so from the thread that connects."""
        if not self._sending:
            self._loop.call_soon_threadsafe(self._write)

    def _write(self) -> None:
        """Write now; what the socket does not take waits until it is ready."""
        paho = self._client
        try:
            paho.loop_write()
        except Exception as error:  # as aiomqtt: the connection broke
            if not self._disconnected.done():
                self._disconnected.set_exception(error)
            return
        sock = paho.socket()
        if sock is not None and paho.want_write():
            self._room.clear()
            self._loop.add_writer(sock.fileno(), self._write)
        else:
            self._room.set()
