"""The WebSocket to browsers: a snapshot, then changes.

A message is encoded once for all browsers.  Each browser has one task that sends the
newest values; a browser that reads nothing keeps no queue and is closed after a while
(fault F23).  Telemetry goes in frames, as fast as a browser paints them; everything
else passes beside them at once.

Data that the kernel and the server hold for a slow browser form a queue in front of the
slots where the newest wins.  Credit bounds it for telemetry; ``BoundedSocket`` bounds
it for all else, too.
"""

import asyncio
import logging
import socket
from collections.abc import Awaitable, Callable, Coroutine, Iterable
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
from iveg.vital.publish import Hub, Subscriber
from iveg.web.live.encoder import Encoder, frame_text
from iveg.web.live.feed import SUBPROTOCOL, Painting, TelemetryFeed
from iveg.web.presses import read_press
from iveg.web.security.authentication import NO_SESSION, Authenticator
from iveg.web.security.requirements import Reader
from iveg.web.security.roles import Action, Principal

_MAX_MESSAGE = 65536

Stop = Callable[[str | None, Principal, Press], Awaitable[object]]


SEND_BUFFER: Final = 65536
"""In the kernel (bytes, Linux doubles it): 0.2 MB/s over a round trip of 300 ms."""


class BoundedSocket(WebSocketsSansIOProtocol):
    """Sends a message when the kernel has taken all of the one before."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Called once the connection speaks WebSocket."""
        super().connection_made(transport)
        self.transport.set_write_buffer_limits(high=0)
        kernel: socket.socket | None = transport.get_extra_info("socket")
        if kernel is not None:
            kernel.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)


def current_principal(
    websocket: WebSocket, principal: Principal, action: Action
) -> Principal | None:
    """The session as of now; None: it may not."""
    authenticator: Authenticator = websocket.app.state.authenticator
    current = authenticator.current(principal)
    return current if current is not None and current.may(action) else None


class ClientMessages:
    """Messages from one browser: pings, presses, painted frames.

    Answers go out with all else, so that a press is read at once also where the way
    back is full.
    """

    def __init__(
        self,
        websocket: WebSocket,
        subscriber: Subscriber,
        clock: Clock,
        stop: Stop,
        principal: Principal,
        feed: TelemetryFeed,
    ) -> None:
        self._websocket = websocket
        self._subscriber = subscriber
        self._clock = clock
        self._stop = stop
        self._principal = principal
        self._feed = feed

    async def listen(self, others: Iterable[asyncio.Task[None]]) -> None:
        """Until the browser goes or is sent away; then ``others`` end, too."""
        line = self._websocket
        try:
            while line.application_state is WebSocketState.CONNECTED:
                await self._hear(await line.receive_text())
        except WebSocketDisconnect:
            return
        finally:
            for task in others:
                task.cancel()

    async def _hear(self, raw: str) -> None:
        try:
            message = load_json(raw[:_MAX_MESSAGE])
        except UnreadableError as error:
            self._subscriber.append(topics.PROBLEM.name, {"reason": error.reason})
            return
        if not isinstance(message, dict):
            return
        match message.get("type"):
            case "painted":
                now = self._clock().mono
                self._feed.painted(message.get("frame"), now, message)
            case "ping":
                t, server = message.get("t"), self._clock().wall
                self._subscriber.append(topics.PONG.name, {"t": t, "server": server})
            case "stop":
                await self._press(message)

    async def _press(self, message: dict[str, object]) -> None:
        robot_id = message.get("robot_id")
        who = current_principal(self._websocket, self._principal, "stop")
        if who is not None and (robot_id is None or isinstance(robot_id, str)):
            try:
                await self._stop(robot_id, who, read_press(message))
            except UnknownRobotError as error:
                reason = legible(str(error))
                self._subscriber.append(topics.PROBLEM.name, {"reason": reason})


TOO_SLOW = 4008
_SEND_LIMIT_S = 10.0


class Line:
    """The messages to one browser, one after the other.

    Args:
        limit_s: How long a browser may take to read one.
    """

    def __init__(
        self,
        websocket: WebSocket,
        subscriber: Subscriber,
        encoder: Encoder,
        clock: Clock,
        limit_s: float = _SEND_LIMIT_S,
    ) -> None:
        self._websocket = websocket
        self._subscriber = subscriber
        self._encoder = encoder
        self._clock = clock
        self._limit_s = limit_s
        self._sending_since: float | None = None

    async def say(self, frame: bytes) -> None:
        """Send JSON."""
        await sent(self._websocket.send_text(frame.decode()))

    async def send(self, feed: TelemetryFeed) -> None:
        """Everything, as fast as the browser reads; telemetry as fast as it paints."""
        loop = asyncio.get_running_loop()
        while not self._subscriber.overflowed:
            self._sending_since = None
            await self._subscriber.news(feed.wait_s(self._clock().mono))
            self._sending_since = loop.time()
            await self._send_frame(feed)
            await self._send_news()
        await self.close_slow()

    @property
    def is_stuck(self) -> bool:
        """Whether the browser has not read for long."""
        since = self._sending_since
        now = asyncio.get_running_loop().time()
        return since is not None and now - since > self._limit_s

    async def close_slow(self) -> None:
        """Close: the browser reads too slowly."""
        await sent(self._websocket.close(TOO_SLOW))

    async def _send_frame(self, feed: TelemetryFeed) -> None:
        frame = feed.next_frame(self._clock())
        if frame is not None:
            await sent(self._websocket.send_bytes(frame))

    async def _send_news(self) -> None:
        for topic, item in self._subscriber.drain_events():
            await self.say(self._encoder.event(topic, item))
        for topic in self._subscriber.drain_topics():
            frame = self._encoder.frame(topic)
            if frame is not None:
                await self.say(frame)


async def sent(sending: Coroutine[object, object, None]) -> None:
    """Send; of a socket that has closed meanwhile a server says RuntimeError.

    Raises:
        ConnectionResetError: the browser is gone.
    """
    try:
        await sending
    except RuntimeError as error:
        raise ConnectionResetError(str(error)) from error


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

    ``snapshot`` gives the present state to a new browser; ``stop``
    presses STOP for one robot, or for all, by somebody; ``latency`` is told when pages
    have drawn what was decided.
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
        subscriber = hub.join()
        line = Line(websocket, subscriber, encoder, clock)
        feed = TelemetryFeed(encoder.telemetry, subscriber, Painting(latency))
        try:
            now = clock()
            await line.say(
                frame_text(topics.SNAPSHOT.name, snapshot(principal, now), now)
            )
            async with asyncio.TaskGroup() as tasks:
                sender = tasks.create_task(line.send(feed), name="live-send")
                watcher = tasks.create_task(
                    _watch(websocket, principal, line), name="live-watch"
                )
                messages = ClientMessages(
                    websocket, subscriber, clock, stop, principal, feed
                )
                tasks.create_task(
                    messages.listen((sender, watcher)), name="live-listen"
                )
        except* (WebSocketDisconnect, ConnectionError) as gone:
            _log.debug("browser gone: %s", gone)
        except* Exception:
            # A fault of ours, logged as one; the browser reconnects by itself.
            _log.exception("live: the line of a browser has failed")
        finally:
            hub.leave(subscriber)

    return routes


async def _watch(websocket: WebSocket, principal: Principal, line: Line) -> None:
    """Close soon after the session is over, or when the browser reads nothing.

    STOP stays possible over HTTP.
    """
    while True:
        await asyncio.sleep(_CHECK_S)
        if current_principal(websocket, principal, "read") is None:
            await sent(websocket.close(NO_SESSION))
            return
        if line.is_stuck:
            await line.close_slow()
            return
