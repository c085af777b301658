"""Limits of sign-ins and of WebSocket messages (SECURITY.md).

STOP is never limited: not over HTTP, and not on a WebSocket that sends too much.
Painted frames are counted apart: a page reports every frame that its screen shows.

The gate before all sign-ins together: a flood of them takes little of the loop.

A limit by address alone is none for who has many, and each request that is looked at
costs the loop on which a STOP runs some milliseconds.
"""

import asyncio
import contextlib
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.ngsi.codec import load_json
from iveg.vital.ports import Clock
from iveg.web.problems import Problem
from iveg.web.security.roles import Principal

SIGN_INS, SIGN_INS_WITHIN_S = 5, 60.0
REFUSED_ROWS = 5.0
"""Rows of the audit a second for refused sign-ins, from all addresses together."""
MESSAGES_PER_S = 20
PAINTED_PER_S = 300
"""More than frames are ever sent in a second: every honest report counts."""
SOCKETS = 5
PROGRAM_SOCKETS = 20
"""Programs share one token."""
TOO_MANY_SOCKETS: Final = 4429
"""Close code of ``/live`` for one more than ``SOCKETS`` of the same session."""

LONGEST_DELAY_S = 10
_UNDELAYED = 3
_DELAY_FORGOTTEN_S = 900.0
_ADDRESSES = 1024
_LONGEST_STOP = 4096
"""Bytes of a message that is looked at beyond the limit."""
_FAREWELL_S = 1.0
_SILENT_S = 3.0
"""Pages ping every second; one silent for longer hangs on a dead line."""


class FailedAttempts:
    """Wrong sign-ins by address: five a minute, then one a minute.

    Never a lock-out: tries during the wait do not make it longer.  A right one takes
    none away, for whoever guesses may have an account of their own.
    """

    def __init__(self) -> None:
        self._wrong: OrderedDict[str, deque[float]] = OrderedDict()

    def wait_s(self, address: str, now: float) -> float:
        """Time that this address has to wait (s); 0 when it may try.

        Args:
            address: Where they come from.
            now: Monotonic time (s).
        """
        wrong = self._wrong.get(address)
        if wrong is None or len(wrong) < SIGN_INS:
            return 0.0
        return max(0.0, wrong[-1] + SIGN_INS_WITHIN_S - now)

    def failed(self, address: str, now: float) -> None:
        """Count a wrong sign-in."""
        wrong = self._wrong.setdefault(address, deque(maxlen=SIGN_INS))
        self._wrong.move_to_end(address)
        while wrong and now - wrong[0] > SIGN_INS * SIGN_INS_WITHIN_S:
            wrong.popleft()
        wrong.append(now)
        if len(self._wrong) > _ADDRESSES:
            self._wrong.popitem(last=False)


class AccountDelays:
    """Wrong sign-ins by account: after three the next wait, 1 s, 2 s, … 10 s at most.

    Nobody is refused.  Names that nobody has wait alike, so that none is told.
    """

    def __init__(self) -> None:
        self._wrong: OrderedDict[str, tuple[int, float]] = OrderedDict()

    def delay_s(self, account: str, now: float) -> float:
        """Wait of a proof before it is looked at (s)."""
        wrong, last = self._wrong.get(account, (0, now))
        if not account or wrong < _UNDELAYED or now - last > _DELAY_FORGOTTEN_S:
            return 0.0
        return float(min(LONGEST_DELAY_S, 2 ** (wrong - _UNDELAYED)))

    def failed(self, account: str, now: float) -> None:
        """Count a wrong proof."""
        wrong, _ = self._wrong.pop(account, (0, now))
        self._wrong[account] = min(wrong + 1, 16), now
        if len(self._wrong) > _ADDRESSES:
            self._wrong.popitem(last=False)

    def succeeded(self, account: str) -> None:
        """Forget the wrong ones of this account alone."""
        self._wrong.pop(account, None)


class Allowance:
    """A second's worth of messages, that fills again with time."""

    def __init__(self, per_s: float, now: float) -> None:
        self._per_s = per_s
        self._left = per_s
        self._at = now

    def admit(self, now: float) -> bool:
        """Whether one more may pass (``now`` monotonic, s)."""
        self._left = min(self._per_s, self._left + (now - self._at) * self._per_s)
        self._at = now
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


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
        if scope["type"] != "websocket":
            await self._app(scope, receive, send)
            return
        who = self._identify(HTTPConnection(scope))
        if who is None:
            await self._app(scope, receive, send)
            return
        now = self._clock().mono
        owner = who.session or who.name
        sockets = self._sockets.setdefault(owner, [])
        # Programs only listen: their silence says nothing.
        is_free = (
            len(sockets) < PROGRAM_SOCKETS
            if who.session is None
            else _make_room(sockets, now)
        )
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
    """What a message says that it is; None where it is no STOP by its length alone."""
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


PASS_PER_S: Final = 20.0
"""As many as one thread can compute."""
_SIGN_IN: Final = "/signin"


class SignInGate:
    """Refuses (429) sign-ins beyond twenty a second before anything looks at them."""

    def __init__(self, app: ASGIApp, clock: Clock) -> None:
        self._app, self._clock = app, clock
        self._allowance = Allowance(PASS_PER_S, clock().mono)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if (
            scope["type"] == "http"
            and scope["method"] == "POST"
            and scope["path"] == _SIGN_IN
            and not self._allowance.admit(self._clock().mono)
        ):
            detail = "Too many sign in at once; try again in a moment."
            headers = {"Retry-After": "2", "Connection": "close"}
            refusal = Problem(429, detail, "busy", headers=headers).response()
            await refusal(scope, receive, send)
            return
        await self._app(scope, receive, send)
