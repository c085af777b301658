"""Limits of WebSockets and of their messages (SECURITY.md).

STOP is never limited, not on a WebSocket that sends too much.  Painted frames are
counted apart: a page reports every frame that its screen shows.
"""

import asyncio
import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.ngsi.codec import load_json
from iveg.vital.ports import Clock
from iveg.web.security.attempts import Allowance
from iveg.web.security.roles import Principal

MESSAGES_PER_S = 20
PAINTED_PER_S = 300
"""More than frames are ever sent in a second: every honest report counts."""
SOCKETS = 5
PROGRAM_SOCKETS = 20
"""Programs share one token."""
TOO_MANY_SOCKETS: Final = 4429
"""Close code of ``/live`` for one more than ``SOCKETS`` of the same session."""

_LONGEST_STOP = 4096
"""Bytes of a message that is looked at beyond the limit."""
_FAREWELL_S = 1.0
_SILENT_S = 3.0
"""Pages ping every second; one silent for longer hangs on a dead line."""


@dataclass(eq=False, slots=True)
class _Socket:
    heard_at: float
    allowance: Allowance
    painting: Allowance
    serving: asyncio.Task[None] | None = None
    ended: bool = False

    def end(self) -> None:
        """Serve it no longer."""
        self.ended = True
        if self.serving is not None:
            self.serving.cancel()


class SocketLimits:
    """WebSockets of a principal, and the messages of each.

    Five for a session, twenty for all programs together; twenty messages a second each
    (painted frames: 300).

    Of more WebSockets the silent one is closed: it is a page that lost its line and
    came back.  When all of them are alive the new one is refused, so that the pages of
    one person do not push each other out in turn.

    Args:
        identify: The principal; strangers are left to authentication.
        clock: Read at each message.
    """

    def __init__(
        self,
        app: ASGIApp,
        identify: Callable[[HTTPConnection], Principal | None],
        clock: Clock,
    ) -> None:
        self._app = app
        self._identify = identify
        self._clock = clock
        self._sockets: dict[bytes | str, list[_Socket]] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        is_socket = scope["type"] == "websocket"
        who = self._identify(HTTPConnection(scope)) if is_socket else None
        if who is None:
            await self._app(scope, receive, send)
            return
        now = self._clock().mono
        owner = who.session or who.name
        sockets = self._sockets.setdefault(owner, [])
        # Programs only listen: their silence says nothing.
        is_free = len(sockets) < PROGRAM_SOCKETS
        if who.session is not None:
            is_free = _make_room(sockets, now)
        if not is_free:
            await _refuse(scope, receive, send)
            return
        socket = _Socket(
            now, Allowance(MESSAGES_PER_S, now), Allowance(PAINTED_PER_S, now)
        )
        sockets.append(socket)
        try:
            await self._serve(socket, scope, receive, send)
        finally:
            sockets.remove(socket)
            if not sockets:
                self._sockets.pop(owner, None)

    async def _serve(
        self, socket: _Socket, scope: Scope, receive: Receive, send: Send
    ) -> None:
        async def run() -> None:
            await self._app(scope, self._listening(socket, receive), send)

        socket.serving = asyncio.create_task(run(), name="live-socket")
        try:
            await socket.serving
        except asyncio.CancelledError:
            if not socket.ended:
                raise
            # Its line is dead, so this may not arrive; the server ends it all the same.
            with contextlib.suppress(TimeoutError, OSError, RuntimeError):
                async with asyncio.timeout(_FAREWELL_S):
                    await send({"type": "websocket.close", "code": TOO_MANY_SOCKETS})

    def _listening(self, socket: _Socket, receive: Receive) -> Receive:
        """The messages of a page, within its limits."""

        async def receive_limited() -> Message:
            while True:
                message = await receive()
                now = self._clock().mono
                socket.heard_at = now
                if message["type"] != "websocket.receive":
                    return message
                kind = _kind_of(message)
                of = socket.painting if kind == "painted" else socket.allowance
                if kind == "stop" or of.admit(now):
                    return message

        return receive_limited


def _make_room(sockets: list[_Socket], now: float) -> bool:
    """Whether one more WebSocket may come in; ends a silent one where it must."""
    served = [socket for socket in sockets if not socket.ended]
    if len(served) < SOCKETS:
        return True
    silent = min(served, key=lambda socket: socket.heard_at)
    if now - silent.heard_at < _SILENT_S:
        return False
    silent.end()
    return True


def _kind_of(message: Message) -> object:
    """Kind that a message names; None where it is no STOP by its length alone."""
    text = message.get("text") or ""
    if len(text) > _LONGEST_STOP:
        return None
    try:
        read = load_json(text)
    except UnreadableError:
        return None
    return read.get("type") if isinstance(read, dict) else None


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    # A browser sees close codes only after the handshake.
    await receive()
    subprotocol = next(iter(scope.get("subprotocols", ())), None)
    await send({"type": "websocket.accept", "subprotocol": subprotocol})
    await send({"type": "websocket.close", "code": TOO_MANY_SOCKETS})
