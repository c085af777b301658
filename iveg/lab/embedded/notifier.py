"""Delivery of notifications: HTTP/1.1, kept alive, in order, apart from slow receivers.

Each subscription has one lane: a bounded queue and one connection.  Once a receiver has
kept a connection open, a lane sends ahead of the responses (pipelining), so that a busy
receiver costs no round trip per message.  A request is repeated only if the receiver
never read it because it had closed an idle connection.
"""

import asyncio
import logging
import ssl
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

import httptools

from iveg.lab.embedded.http_requests import NotificationTarget

_log = logging.getLogger(__name__)
_AHEAD = 8
_MAX_QUEUED = 1000

REFUSED = "Couldn't connect to server"
TIMED_OUT = "Timeout was reached"
CLOSED = "Server returned nothing (no headers, no data)"


@dataclass(slots=True)
class Delivery:
    """One request on its way.

    Attributes:
        request: Head and body, ready to send.
        timeout_s: Time limit of the response (s).
        done: Called with status and body, or with 0 and libcurl's wording of the error.
    """

    request: bytes
    timeout_s: float
    done: Callable[[int, bytes | str], None]
    tried: bool = False


class DeliveryLane:
    """A queue and one connection to one receiver, in order."""

    def __init__(self, target: NotificationTarget) -> None:
        self._target = target
        self._waiting: deque[Delivery] = deque()
        self._flying: deque[Delivery] = deque()
        self._wire: _Wire | None = None
        self._connecting: asyncio.Task[None] | None = None
        self._proven = False
        self._closed = False
        self._overflowing = False
        self._timer: asyncio.TimerHandle | None = None
        self._first_until = 0.0
        """Until when the first delivery under way is awaited (loop time, s)."""

    def send(self, delivery: Delivery) -> None:
        """Queue one delivery; beyond a thousand the oldest is dropped."""
        if len(self._waiting) >= _MAX_QUEUED:
            self._waiting.popleft().done(0, TIMED_OUT)
            if not self._overflowing:
                _log.warning("%s reads too slowly; the oldest give way", self._target)
                self._overflowing = True
        self._waiting.append(delivery)
        self._pump()

    def close(self) -> None:
        """Close the connection; unsent deliveries are lost."""
        self._closed = True
        self._stop_timer()
        if self._connecting is not None:
            self._connecting.cancel()
        self._waiting.clear()
        self._flying.clear()
        if self._wire is not None:
            self._wire.transport.abort()

    def _pump(self) -> None:
        if self._closed or not self._waiting:
            return
        if self._wire is None:
            if self._connecting is None:
                self._connecting = asyncio.get_running_loop().create_task(
                    self._connect(), name="embedded-notifier-connect"
                )
            return
        room = (_AHEAD if self._proven else 1) - len(self._flying)
        while room > 0 and self._waiting:
            delivery = self._waiting.popleft()
            if not self._flying:
                self._await_first(delivery.timeout_s)
            self._flying.append(delivery)
            self._wire.transport.write(delivery.request)
            room -= 1
        if not self._waiting:
            self._overflowing = False

    async def _connect(self) -> None:
        target = self._target
        try:
            async with asyncio.timeout(self._waiting[0].timeout_s):
                _, self._wire = await asyncio.get_running_loop().create_connection(
                    lambda: _Wire(self),
                    target.host,
                    target.port,
                    ssl=ssl.create_default_context() if target.tls else None,
                )
            self._proven = False
        except OSError as error:
            timed_out = isinstance(error, TimeoutError)
            self._waiting.popleft().done(0, TIMED_OUT if timed_out else REFUSED)
        finally:
            self._connecting = None
        self._pump()

    def answered(self, wire: "_Wire", status: int, body: bytes, *, keep: bool) -> None:
        """The oldest delivery under way got its response."""
        if wire is not self._wire or not self._flying:
            return
        self._flying.popleft().done(status, body)
        if not keep:
            self.lost(wire)
            wire.transport.close()
            return
        self._proven = True
        if self._flying:
            self._await_first(self._flying[0].timeout_s)
        self._pump()

    def lost(self, wire: "_Wire") -> None:
        """The connection was lost; unanswered deliveries may be sent once more."""
        if wire is not self._wire or self._closed:
            return
        self._wire = None
        self._stop_timer()
        again = []
        for delivery in self._flying:
            if self._proven and not delivery.tried:
                delivery.tried = True
                again.append(delivery)
            else:
                delivery.done(0, CLOSED)
        self._flying.clear()
        self._waiting.extendleft(reversed(again))
        self._pump()

    def _await_first(self, timeout_s: float) -> None:
        """Give the first delivery under way its time.

        A timer that runs is left alone: most responses come long before it.
        """
        loop = asyncio.get_running_loop()
        self._first_until = loop.time() + timeout_s
        if self._timer is None or self._timer.when() > self._first_until:
            self._stop_timer()
            self._timer = loop.call_at(self._first_until, self._check_first)

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _check_first(self) -> None:
        self._timer = None
        loop = asyncio.get_running_loop()
        if self._flying and loop.time() < self._first_until:
            self._timer = loop.call_at(self._first_until, self._check_first)
        elif self._flying and self._wire is not None:
            self._flying.popleft().done(0, TIMED_OUT)
            self._wire.transport.abort()


class _Wire(asyncio.Protocol):
    """One connection of a lane: tells it the responses."""

    transport: asyncio.Transport

    def __init__(self, lane: DeliveryLane) -> None:
        self._lane = lane
        self._parser = httptools.HttpResponseParser(self)
        self._body: list[bytes] = []

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Connected."""
        self.transport = cast("asyncio.Transport", transport)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's
        """The receiver or this side closed the connection."""
        self._lane.lost(self)

    def data_received(self, data: bytes) -> None:
        """Part of a response."""
        try:
            self._parser.feed_data(data)
        except httptools.HttpParserError:
            self.transport.abort()

    def on_message_begin(self) -> None:
        """A response begins."""
        self._body = []

    def on_body(self, body: bytes) -> None:
        """Part of the body."""
        self._body.append(body)

    def on_message_complete(self) -> None:
        """The response is complete."""
        status = self._parser.get_status_code()
        if status >= 200:
            keep = self._parser.should_keep_alive()
            self._lane.answered(self, status, b"".join(self._body), keep=keep)


async def exchange(
    target: NotificationTarget, request: bytes, timeout_s: float
) -> tuple[int, bytes | str]:
    """Send one request on a connection of its own and wait for the response.

    Returns:
        Status and body, or 0 and the error.
    """
    answer: asyncio.Future[tuple[int, bytes | str]] = (
        asyncio.get_running_loop().create_future()
    )

    def done(status: int, body: bytes | str) -> None:
        if not answer.done():
            answer.set_result((status, body))

    lane = DeliveryLane(target)
    lane.send(Delivery(request, timeout_s, done))
    try:
        return await answer
    finally:
        lane.close()
