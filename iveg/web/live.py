"""The WebSocket to browsers: a snapshot, then what changes.

A message is encoded once, whoever looks: state topics by their version, scans as
binary.  Each browser has one task that sends what is newest; a browser that reads
nothing keeps no queue and is closed after a while (fault F23).
"""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable
from typing import Annotated, Any

import orjson
from fastapi import APIRouter, Depends, WebSocket, WebSocketDisconnect

from iveg.domain.errors import UnknownRobotError, UnreadableError
from iveg.domain.observations import Instant
from iveg.domain.records import LogRecord
from iveg.domain.stop import Command, Press
from iveg.ngsi.codec import load_json
from iveg.pipeline.publish import Hub, Subscriber
from iveg.web.auth import NO_SESSION, Action, Door, Principal, require
from iveg.web.presses import read_press
from iveg.web.shapes import log_line
from iveg.web.views import Views

_log = logging.getLogger(__name__)
TOO_SLOW = 4008
_SEND_LIMIT_S = 10.0
_SESSION_CHECK_S = 0.5
_MAX_MESSAGE = 65536
_SNAPSHOT_LINES = 200
_CACHE = 512

Stop = Callable[[str | None, str, Press], Awaitable[object]]


class Encoder:
    """Turns topics into frames, each version once."""

    def __init__(
        self,
        views: Views,
        hub: Hub,
        clock: Callable[[], Instant],
        health: Callable[[Instant], Any],
    ) -> None:
        self._views = views
        self._hub = hub
        self._clock = clock
        self._health = health
        self._frames: dict[str, tuple[int, bytes]] = {}

    def frame(self, topic: str) -> bytes | None:
        """The newest frame of a state topic; None when there is nothing to say."""
        version = self._hub.versions[topic]
        kept = self._frames.get(topic)
        if kept is not None and kept[0] == version:
            return kept[1]
        frame = self._encode(topic)
        if frame is not None:
            if len(self._frames) >= _CACHE:
                self._frames.clear()
            self._frames[topic] = version, frame
        return frame

    def _encode(self, topic: str) -> bytes | None:
        now = self._clock()
        kind, _, rest = topic.partition("/")
        if kind == "robots" and rest.endswith("/scan"):
            return self._scan(topic, rest.removesuffix("/scan"), now)
        data: Any = None
        if kind == "robots":
            data = self._views.robot(rest, now)
        elif kind == "detections":
            data = self._views.frame(rest, now)
        elif kind == "people":
            data = self._views.people(now)
        elif kind == "alerts":
            data = self._views.alerts()
        elif kind == "flood":
            data = self._views.flood()
        elif kind == "rule":
            data = self._views.rule()
        elif kind == "health":
            data = self._health(now)
        elif kind == "climate":
            data = self._views.climate(now)
        return None if data is None else text(topic, data)

    def _scan(self, topic: str, robot_id: str, now: Instant) -> bytes | None:
        swept = self._views.scan(robot_id)
        if swept is None:
            return None
        scan, points = swept
        head = orjson.dumps(
            {
                "topic": topic,
                "robot_id": robot_id,
                "stamp": scan.origin.stamp,
                "age_s": self._views.scan_age_s(robot_id, now),
            }
        )
        head += b" " * (-len(head) % 4)
        return len(head).to_bytes(4, "little") + head + points.tobytes()

    def event(self, topic: str, item: object) -> bytes:
        """The frame of an event that nobody may miss."""
        data: Any = item
        if isinstance(item, LogRecord):
            data = log_line(item)
        elif isinstance(item, Command):
            data = self._views.command(item, self._clock())
        return text(topic, data)


def text(topic: str, data: Any) -> bytes:
    """A JSON frame."""
    return orjson.dumps({"topic": topic, "data": data})


def router(
    hub: Hub,
    encoder: Encoder,
    snapshot: Callable[[Principal, Instant], dict[str, Any]],
    clock: Callable[[], Instant],
    stop: Stop,
) -> APIRouter:
    """The live endpoint.

    ``snapshot`` says everything that is known to one who has just come; ``stop``
    presses STOP for one robot, or for all, by somebody.
    """
    routes = APIRouter()

    @routes.websocket("/live")
    async def live(
        websocket: WebSocket,
        principal: Annotated[Principal, Depends(require("read"))],
    ) -> None:
        """A browser looks."""
        await websocket.accept()
        subscriber = hub.join()
        try:
            first = text("snapshot", snapshot(principal, clock()))
            await websocket.send_text(first.decode())
            async with asyncio.TaskGroup() as tasks:
                sender = tasks.create_task(
                    _send(websocket, subscriber, encoder), name="live-send"
                )
                watcher = tasks.create_task(
                    _watch_session(websocket, principal), name="live-session"
                )
                tasks.create_task(
                    _listen(websocket, clock, stop, principal, (sender, watcher)),
                    name="live-listen",
                )
        except* (WebSocketDisconnect, ConnectionError, RuntimeError) as gone:
            _log.debug("browser gone: %s", gone)
        finally:
            hub.leave(subscriber)

    return routes


async def _send(websocket: WebSocket, subscriber: Subscriber, encoder: Encoder) -> None:
    while True:
        events, topics = await subscriber.take()
        if subscriber.overflowed:
            await websocket.close(TOO_SLOW)
            return
        try:
            async with asyncio.timeout(_SEND_LIMIT_S):
                for topic, item in events:
                    frame = encoder.event(topic, item)
                    await websocket.send_text(frame.decode())
                for topic in topics:
                    await _send_state(websocket, topic, encoder)
        except TimeoutError:
            await websocket.close(TOO_SLOW)
            return


async def _watch_session(websocket: WebSocket, principal: Principal) -> None:
    """Close soon after the session is over; STOP stays possible over HTTP."""
    while True:
        await asyncio.sleep(_SESSION_CHECK_S)
        if not _may_still(websocket, principal, "read"):
            await websocket.close(NO_SESSION)
            return


def _may_still(websocket: WebSocket, principal: Principal, action: Action) -> bool:
    door: Door = websocket.app.state.door
    current = door.sessions.current(principal)
    return current is not None and current.may(action)


async def _send_state(websocket: WebSocket, topic: str, encoder: Encoder) -> None:
    frame = encoder.frame(topic)
    if frame is None:
        return
    if topic.endswith("/scan"):
        await websocket.send_bytes(frame)
    else:
        await websocket.send_text(frame.decode())


async def _listen(
    websocket: WebSocket,
    clock: Callable[[], Instant],
    stop: Stop,
    principal: Principal,
    others: Iterable[asyncio.Task[None]],
) -> None:
    try:
        while True:
            raw = await websocket.receive_text()
            try:
                message = load_json(raw[:_MAX_MESSAGE])
            except UnreadableError as error:
                await websocket.send_text(
                    text("problem", {"reason": error.reason}).decode()
                )
                continue
            if isinstance(message, dict):
                await _answer(websocket, message, clock(), stop, principal)
    except WebSocketDisconnect:
        return
    finally:
        for task in others:
            task.cancel()


async def _answer(
    websocket: WebSocket,
    message: dict[str, Any],
    now: Instant,
    stop: Stop,
    principal: Principal,
) -> None:
    if message.get("type") == "ping":
        pong = {"t": message.get("t"), "server": now.wall}
        await websocket.send_text(text("pong", pong).decode())
    elif message.get("type") == "stop":
        robot_id = message.get("robot_id")
        allowed = _may_still(websocket, principal, "stop")
        if allowed and (robot_id is None or isinstance(robot_id, str)):
            try:
                await stop(robot_id, principal.name, read_press(message))
            except UnknownRobotError as error:
                problem = text("problem", {"reason": str(error)})
                await websocket.send_text(problem.decode())
