"""Writing MQTT: telemetry together and at once.

The client library's ``publish`` makes an event, a task and two tables for each message
and takes three turns of the loop, which is most of the cost of a robot's telemetry.
Nobody confirms messages at QoS 0, so here they are handed over together, written at
once, and wait only while the socket is full.
"""

import asyncio
from collections.abc import Iterable
from typing import Any

from iveg.adapters.mqtt_inbox import GreedyClient

_PUBLISH, _UNTOLD = b"\x30", 0


class PromptClient(GreedyClient):
    """A client with a short way for telemetry, which waits only for a full socket."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._sending = False
        self._room = asyncio.Event()
        self._room.set()

    def send(self, messages: Iterable[tuple[str, bytes]]) -> None:
        """Write these at QoS 0, as far as the socket takes them."""
        packets = b"".join(packet_of(topic, payload) for topic, payload in messages)
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


def packet_of(topic: str, payload: bytes) -> bytes:
    """A PUBLISH at QoS 0 that is not retained (MQTT 3.1.1, section 3.3)."""
    name = topic.encode()
    size = 2 + len(name) + len(payload)
    return b"".join((_PUBLISH, _length(size), len(name).to_bytes(2), name, payload))


def _length(size: int) -> bytes:
    """A remaining length: seven bits a byte, the lowest first (section 2.2.3)."""
    parts = bytearray()
    while size > 127:
        parts.append(size & 127 | 128)
        size >>= 7
    parts.append(size)
    return bytes(parts)
