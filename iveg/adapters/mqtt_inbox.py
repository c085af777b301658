"""How MQTT is read: all that has come in one call, and of telemetry only the newest.

The client library reads a packet's parts one by one from the socket, and one packet a
turn of the loop.  While the loop has much else to do, that is slower than a fleet
talks: what waits on the wire grows old, the robots' answers to a STOP behind it.
"""

import asyncio
import socket
import ssl
from collections import deque
from typing import Any

import aiomqtt
from paho.mqtt import client as paho

READ_AHEAD = 256 << 10
"""Taken from the wire in one call (bytes): some thirty scans."""


class GreedyClient(aiomqtt.Client):
    """A client that reads whatever has come whenever its socket can be read."""

    def _on_socket_open(self, client: paho.Client, userdata: Any, sock: Any) -> None:
        # aiomqtt reads on while a socket has something pending; paho reads from this.
        # Neither has a public way to say which socket.
        client._sock = ReadAhead(sock)
        super()._on_socket_open(client, userdata, client._sock)


class ReadAhead:
    """A socket whose bytes are taken in large pieces, one an event.

    One only, so that a flood from the broker leaves the loop its other work: then
    ``recv`` would block until ``pending`` has said that there is nothing more.
    """

    def __init__(self, inner: socket.socket) -> None:
        self._inner = inner
        self._held = memoryview(b"")
        self._may_take = True

    def __getattr__(self, name: str) -> Any:
        """Everything else is the socket's own."""
        return getattr(self._inner, name)

    def recv(self, size: int) -> bytes:
        """Up to ``size`` bytes; none at the end.

        Raises:
            BlockingIOError: nothing is there for now.
        """
        if not self._held:
            if not self._may_take:
                raise BlockingIOError
            self._held = memoryview(self._inner.recv(READ_AHEAD))
            self._may_take = False
        part, self._held = self._held[:size], self._held[size:]
        return bytes(part)

    def pending(self) -> int:
        """What can be read without a further event (bytes)."""
        if self._held:
            return len(self._held)
        self._may_take = True
        inner = self._inner
        return inner.pending() if isinstance(inner, ssl.SSLSocket) else 0


class Inbox(asyncio.Queue[aiomqtt.Message]):
    """What waits to be read: of a topic's telemetry (QoS 0) only the newest.

    A reader that falls behind must not read ever older news; what was sent at QoS 1
    (orders, answers, safety reports) is kept, in order.
    """

    _queue: "deque[aiomqtt.Message | str]"

    def _init(self, maxsize: int) -> None:
        super()._init(maxsize)
        self._newest: dict[str, aiomqtt.Message] = {}

    def _put(self, item: aiomqtt.Message) -> None:
        if item.qos > 0:
            self._queue.append(item)
            return
        topic = item.topic.value
        if topic not in self._newest:
            self._queue.append(topic)
        self._newest[topic] = item

    def _get(self) -> aiomqtt.Message:
        waiting = self._queue.popleft()
        return self._newest.pop(waiting) if isinstance(waiting, str) else waiting
