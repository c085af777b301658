"""Messages from one browser: pings, presses, painted frames."""

import asyncio
from collections.abc import Awaitable, Callable, Iterable

from fastapi import WebSocket, WebSocketDisconnect
from starlette.websockets import WebSocketState

from iveg.domain.errors import UnknownRobotError, UnreadableError
from iveg.domain.stop import Press
from iveg.ngsi.codec import load_json
from iveg.ngsi.texts import legible
from iveg.pipeline import topics
from iveg.pipeline.ports import Clock
from iveg.pipeline.publish import Subscriber
from iveg.web.live.feed import TelemetryFeed
from iveg.web.presses import read_press
from iveg.web.security.authentication import Authenticator
from iveg.web.security.roles import Action, Principal

_MAX_MESSAGE = 65536

Stop = Callable[[str | None, Principal, Press], Awaitable[object]]


def current_principal(
    websocket: WebSocket, principal: Principal, action: Action
) -> Principal | None:
    """The same session as of now, as a tablet changes hands; None: it may not."""
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
