"""Limits of sign-ins, of WebSockets and of their messages (SECURITY.md).

One mechanism, an ``Allowance``, bounds all of them.  STOP is never limited, not on a
WebSocket that sends too much.
"""

from collections import Counter
from collections.abc import Callable
from typing import Final

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.ngsi.codec import load_json
from iveg.vital.ports import Clock
from iveg.web.problems import Problem
from iveg.web.security.roles import Principal

SIGN_INS_PER_S: Final = 20.0
"""Sign-ins that the thread of passwords can compute in a second."""
MESSAGES_PER_S: Final = 300.0
"""More than a page ever sends: it reports each frame that its screen has shown."""
SOCKETS: Final = 20
TOO_MANY_SOCKETS: Final = 4429
"""Close code of ``/live`` beyond ``SOCKETS`` connections of an owner."""

_LONGEST_STOP = 4096
"""Longest message (bytes) that is still read for a STOP beyond the limit."""


class Allowance:
    """A number of uses that fills again with time (a token bucket).

    Args:
        most: Uses that may come at once.
        per_s: Uses that come back in a second.
        now: Monotonic time (s).
    """

    def __init__(self, most: float, per_s: float, now: float) -> None:
        self._most, self._per_s = most, per_s
        self._left, self._at = most, now

    def wait_s(self, now: float) -> float:
        """Time until one more is allowed (s); 0: it is allowed now."""
        uses_left = self._left + (now - self._at) * self._per_s
        return max(0.0, (1.0 - uses_left) / self._per_s)

    def admit(self, now: float) -> bool:
        """Take a use; returns whether it was allowed."""
        if self.wait_s(now) > 0.0:
            return False
        uses_left = self._left + (now - self._at) * self._per_s
        self._left, self._at = min(self._most, uses_left) - 1.0, now
        return True


class SignInGate:
    """Refuses (429) sign-ins beyond twenty a second before anything reads them.

    An attacker with many addresses passes every limit by address.  Each request that is
    read takes some milliseconds of the loop on which a STOP runs.
    """

    def __init__(self, app: ASGIApp, clock: Clock) -> None:
        self._app, self._clock = app, clock
        self._allowance = Allowance(SIGN_INS_PER_S, SIGN_INS_PER_S, clock().mono)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        is_sign_in = (
            scope["type"] == "http"
            and scope["method"] == "POST"
            and scope["path"] == "/signin"
        )
        if is_sign_in and not self._allowance.admit(self._clock().mono):
            detail = "Too many sign in at once; try again in a moment."
            headers = {"Retry-After": "2", "Connection": "close"}
            refusal = Problem(429, detail, "busy", headers=headers).response()
            await refusal(scope, receive, send)
            return
        await self._app(scope, receive, send)


class SocketLimits:
    """At most twenty WebSockets of a session or program, and 300 messages a second.

    Args:
        identify: Finds the principal; strangers are left to authentication.
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
        self._open: Counter[str] = Counter()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one connection."""
        is_socket = scope["type"] == "websocket"
        principal = self._identify(HTTPConnection(scope)) if is_socket else None
        if principal is None:
            await self._app(scope, receive, send)
            return
        owner = principal.session or principal.name
        if self._open[owner] >= SOCKETS:
            await _refuse(scope, receive, send)
            return
        self._open[owner] += 1
        try:
            await self._app(scope, self._limited(receive), send)
        finally:
            self._open[owner] -= 1
            # Else every ended session would stay in the table.
            if not self._open[owner]:
                del self._open[owner]

    def _limited(self, receive: Receive) -> Receive:
        """The messages of one WebSocket, within the limit; each STOP beyond it, too."""
        allowance = Allowance(MESSAGES_PER_S, MESSAGES_PER_S, self._clock().mono)

        async def receive_limited() -> Message:
            while True:
                message = await receive()
                # Messages beyond the limit are dropped unread, but never a STOP.
                if (
                    message["type"] != "websocket.receive"
                    or allowance.admit(self._clock().mono)
                    or _is_stop(message)
                ):
                    return message

        return receive_limited


def _is_stop(message: Message) -> bool:
    text = message.get("text") or ""
    if len(text) > _LONGEST_STOP:
        return False
    try:
        read = load_json(text)
    except UnreadableError:
        return False
    return isinstance(read, dict) and read.get("type") == "stop"


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    # A browser sees close codes only after the handshake.
    await receive()
    subprotocol = next(iter(scope.get("subprotocols", ())), None)
    await send({"type": "websocket.accept", "subprotocol": subprotocol})
    await send({"type": "websocket.close", "code": TOO_MANY_SOCKETS})
