"""The WebSocket to browsers: a snapshot, then changes.

A message is encoded once for all browsers.  Each browser has one task that sends the
newest values; a browser that reads nothing keeps no queue and is closed after a while
(fault F23).  Telemetry goes in frames, as fast as a browser paints them; everything
else passes beside them at once.

Data that the kernel and the server hold for a slow browser form a queue in front of the
slots where the newest wins.  Credit bounds this queue for telemetry, ``BoundedSocket``
for all else.
"""

import asyncio
import logging
import socket
from collections.abc import Awaitable, Callable, Coroutine
from contextlib import suppress
from typing import Final

from fastapi import APIRouter, WebSocket, WebSocketDisconnect
from starlette.websockets import WebSocketState
from uvicorn.protocols.websockets.websockets_sansio_impl import (
    WebSocketsSansIOProtocol,
)

from iveg.domain.errors import UnknownRobotError, UnreadableError
from iveg.domain.latency import LatencyWatch
from iveg.domain.observations import Instant
from iveg.domain.stop import Press
from iveg.domain.wire import legible
from iveg.models.snapshot import Snapshot
from iveg.ngsi.codec import load_json
from iveg.vital import topics
from iveg.vital.ports import Clock
from iveg.vital.publish import Hub, Subscriber, drain
from iveg.web.live.encoder import Encoder, frame_text
from iveg.web.live.feed import SUBPROTOCOL, Painting, TelemetryFeed
from iveg.web.presses import read_press
from iveg.web.security.authentication import NO_SESSION
from iveg.web.security.requirements import Reader, authenticator_of
from iveg.web.security.roles import Action, Principal

_MAX_MESSAGE = 65536

Stop = Callable[[str | None, Principal, Press], Awaitable[object]]


SEND_BUFFER: Final = 65536
"""Kernel's send buffer (bytes; Linux doubles it): 0.2 MB/s at 300 ms round trip."""


class BoundedSocket(WebSocketsSansIOProtocol):
    """Sends a message only once the kernel has taken the whole one before."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Bound the buffers of a connection that has begun to speak WebSocket."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=0)
        kernel: socket.socket | None = transport.get_extra_info("socket")
        if kernel is not None:
            kernel.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)


def current_principal(websocket: WebSocket, action: Action) -> Principal | None:
    """The caller, if the role still allows the action; else None."""
    current = authenticator_of(websocket).identify(websocket)
    return current if current is not None and current.may(action) else None


TOO_SLOW = 4008
_READ_WITHIN_S = 10.0
"""Time in which a browser has to read a message (s)."""


class Line:
    """Messages to one browser, one after the other, and messages from it.

    Answers wait in the queue of all messages.  So a press is read at once even while
    nothing can be sent.

    Args:
        feed: Makes its telemetry.
        within_s: Time in which a browser has to read a message (s).
    """

    def __init__(
        self,
        websocket: WebSocket,
        subscriber: Subscriber,
        encoder: Encoder,
        feed: TelemetryFeed,
        clock: Clock,
        within_s: float = _READ_WITHIN_S,
    ) -> None:
        self._websocket, self._subscriber = websocket, subscriber
        self._encoder, self._feed, self._clock = encoder, feed, clock
        self._within_s = within_s

    async def say(self, frame: bytes) -> None:
        """Send JSON."""
        await self._sent(self._websocket.send_text(frame.decode()))

    async def send(self) -> None:
        """Send all messages as fast as the browser reads; telemetry as it paints."""
        while not self._subscriber.overflowed:
            await self._subscriber.news(self._feed.wait_s(self._clock().mono))
            frame = self._feed.next_frame(self._clock())
            if frame is not None:
                await self._sent(self._websocket.send_bytes(frame))
            for topic, item in drain(self._subscriber.pending):
                await self.say(self._encoder.event(topic, item))
            for topic in drain(self._subscriber.dirty):
                if (data := self._encoder.frame(topic)) is not None:
                    await self.say(data)
        await self.close(TOO_SLOW)

    async def close(self, code: int) -> None:
        """Send the browser away."""
        await self._sent(self._websocket.close(code))

    async def _sent(self, sending: Coroutine[object, object, None]) -> None:
        """Send, and turn the errors of a closed or blocked socket into one kind.

        Raises:
            ConnectionError: the browser has left, or reads nothing.
        """
        try:
            async with asyncio.timeout(self._within_s):
                await sending
        except RuntimeError as error:
            # The server's error for a socket that has closed meanwhile.
            raise ConnectionResetError(str(error)) from error
        except TimeoutError as error:
            with suppress(RuntimeError, TimeoutError):
                async with asyncio.timeout(_CHECK_S):
                    await self._websocket.close(TOO_SLOW)
            raise ConnectionAbortedError("reads too slowly") from error

    async def listen(self, stop: Stop) -> None:
        """Take pings, presses and painted frames until the browser goes."""
        while self._websocket.application_state is WebSocketState.CONNECTED:
            raw = await self._websocket.receive_text()
            try:
                # A longer message is cut: the rest is no JSON and is refused.
                message = load_json(raw[:_MAX_MESSAGE])
            except UnreadableError as error:
                self._complain(error.reason)
                continue
            if not isinstance(message, dict):
                continue
            match message.get("type"):
                case "painted":
                    frame, now = message.get("frame"), self._clock().mono
                    self._feed.painted(frame, now, message)
                case "ping":
                    pong = {"t": message.get("t"), "server": self._clock().wall}
                    self._subscriber.append(topics.PONG.name, pong)
                case "stop":
                    await self._press(message, stop)

    async def _press(self, message: dict[str, object], stop: Stop) -> None:
        robot_id = message.get("robot_id")
        # Asked anew at each press: the account may have been disabled meanwhile.
        principal = current_principal(self._websocket, "stop")
        if principal is not None and (robot_id is None or isinstance(robot_id, str)):
            try:
                await stop(robot_id, principal, read_press(message))
            except UnknownRobotError as error:
                self._complain(legible(str(error)))

    def _complain(self, reason: str) -> None:
        self._subscriber.append(topics.PROBLEM.name, {"reason": reason})

    async def watch(self) -> None:
        """Close soon after the session is over.  STOP stays possible over HTTP."""
        while True:
            await asyncio.sleep(_CHECK_S)
            if current_principal(self._websocket, "read") is None:
                await self.close(NO_SESSION)
                return


_log = logging.getLogger(__name__)
NO_PROTOCOL = 4406
"""Close code of a program that does not ask for ``iveg.2``."""
_CHECK_S = 0.5


def router(
    hub: Hub,
    encoder: Encoder,
    snapshot: Callable[[Principal, Instant], Snapshot],
    clock: Clock,
    stop: Stop,
    latency: LatencyWatch,
) -> APIRouter:
    """The live endpoint.

    ``snapshot`` gives the present state to a new browser.  ``stop`` presses STOP for
    one robot, or for all.  ``latency`` takes the moments at which pages drew decisions.
    """
    routes = APIRouter()

    @routes.websocket("/live")
    async def live(
        websocket: WebSocket,
        principal: Reader,
    ) -> None:
        """Serve one browser."""
        if SUBPROTOCOL not in websocket.scope.get("subprotocols", ()):
            # Close codes are seen only after the handshake.
            await websocket.accept()
            await websocket.close(NO_PROTOCOL)
            return
        await websocket.accept(SUBPROTOCOL)
        # Joined before the snapshot: news that comes while it is sent is not lost.
        subscriber = hub.join()
        feed = TelemetryFeed(encoder.telemetry, subscriber, Painting(latency))
        line = Line(websocket, subscriber, encoder, feed, clock)
        try:
            now = clock()
            await line.say(
                frame_text(topics.SNAPSHOT.name, snapshot(principal, now), now)
            )
            async with asyncio.TaskGroup() as tasks:
                tasks_beside = [
                    tasks.create_task(line.send(), name="live-send"),
                    tasks.create_task(line.watch(), name="live-watch"),
                ]
                with suppress(WebSocketDisconnect):
                    await line.listen(stop)
                for task in tasks_beside:
                    task.cancel()
        except* (WebSocketDisconnect, ConnectionError) as loss:
            _log.debug("live: browser lost: %s", loss)
        except* Exception:
            # A fault of ours, logged as one; the browser reconnects by itself.
            _log.exception("live: the connection of a browser has failed")
        finally:
            hub.leave(subscriber)

    return routes
