"""How MQTT is written: telemetry together and at once.

The client library's ``publish`` makes an event, a task and two tables for each message
and takes three turns of the loop, which is most of what a robot's telemetry costs.
What goes at QoS 0 is confirmed by nobody, so here it is handed over together, written
at once, and waits only while the socket is full.
"""

import asyncio
import contextlib
import socket
import sys
from collections.abc import Iterable, Iterator
from typing import Any

from iveg.adapters.mqtt_inbox import GreedyClient


class PromptClient(GreedyClient):
    """A client with a short way for telemetry, that waits only for a full socket."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._sending = False
        self._room = asyncio.Event()
        self._room.set()

    def send(self, messages: Iterable[tuple[str, bytes]]) -> None:
        """Write these at QoS 0, as far as the socket takes them."""
        paho = self._client
        # At QoS 0 paho tells of each message that it was written; nobody listens.
        confirm, paho.on_publish = paho.on_publish, None
        self._sending = True
        try:
            for topic, payload in messages:
                paho.publish(topic, payload)
            with _together(paho.socket()):
                self._write()
        finally:
            self._sending = False
            paho.on_publish = confirm

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


@contextlib.contextmanager
def _together(sock: Any) -> Iterator[None]:
    """What is written meanwhile leaves at its end, in as few packets as it fits in.

    Otherwise each message wakes the broker (Linux; elsewhere it does).
    """
    if sock is None or not sys.platform.startswith("linux"):
        yield
        return
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, 1)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # it was closed
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, 0)
