"""Limits of sockets and messages, and that STOP has none."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field

import pytest
from starlette.requests import HTTPConnection
from starlette.types import Message, Receive, Scope, Send

from iveg.web.security.rate_limits import (
    MESSAGES_PER_S,
    SOCKETS,
    TOO_MANY_SOCKETS,
    Allowance,
    SocketLimits,
)
from iveg.web.security.roles import Principal
from tests.fakes.clock import FakeClock

PING, STOP = '{"type": "ping", "t": 1}', '{"type": "stop", "robot_id": "AGI"}'
FLOOD = 2 * int(MESSAGES_PER_S)
_CONNECT = "connect"


def test_an_allowance_is_used_up_and_comes_back_with_time() -> None:
    allowance = Allowance(5.0, 1 / 60, now=0.0)

    assert [allowance.admit(0.0) for _ in range(6)] == [True] * 5 + [False]
    assert allowance.wait_s(20.0) == pytest.approx(40.0)
    assert [allowance.admit(61.0) for _ in range(2)] == [True, False]
    assert [allowance.admit(1e6) for _ in range(6)] == [True] * 5 + [False]


@dataclass
class Server:
    """Takes down what it hears, until the page leaves; ``goes`` lets all leave."""

    clock: FakeClock = field(default_factory=FakeClock)
    heard: list[str] = field(default_factory=list)
    goes: asyncio.Event = field(default_factory=asyncio.Event)

    def __post_init__(self) -> None:
        self.limits = SocketLimits(self, self.identify, self.clock)

    async def __call__(self, _: Scope, receive: Receive, send: Send) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        while (message := await receive())["type"] != "websocket.disconnect":
            self.heard.append(message["text"])

    def identify(self, connection: HTTPConnection) -> Principal | None:
        name = connection.headers["cookie"]
        return Principal(name, "viewer", session=name)

    async def visit(self, texts: Sequence[str | float] = (), who: str = "ana") -> int:
        """Say these, let time pass (s) between; returns the close code, or 0."""
        left, codes = iter([_CONNECT, *texts]), [0]

        async def receive() -> Message:
            for text in left:
                if isinstance(text, str):
                    kind = "connect" if text is _CONNECT else "receive"
                    return {"type": f"websocket.{kind}", "text": text}
                self.clock.now += text
            await self.goes.wait()
            return {"type": "websocket.disconnect"}

        async def send(message: Message) -> None:
            codes.append(message.get("code", 0))

        scope: Scope = {"type": "websocket", "headers": [(b"cookie", who.encode())]}
        await self.limits(scope, receive, send)
        return codes[-1]


async def heard(*texts: str | float) -> list[str]:
    """What of these reaches the server."""
    server = Server()
    server.goes.set()
    await server.visit(texts)
    return server.heard


async def test_i11_of_a_page_that_says_too_much_every_stop_is_heard_alone() -> None:
    told = await heard(*[PING] * FLOOD, 0.5, *[PING] * FLOOD, *[STOP] * 50)

    assert told.count(STOP) == 50
    assert told.count(PING) == 1.5 * MESSAGES_PER_S


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "ping", "t": "\\"stop\\""}',
        '{"type": "stop"',
        '{"type": "stop", "robot_id": "' + "A" * 5000 + '"}',
    ],
)
async def test_what_only_looks_like_a_stop_is_limited(text: str) -> None:
    assert len(await heard(*[text] * FLOOD)) == MESSAGES_PER_S


async def test_a_socket_beyond_twenty_of_a_session_is_refused_until_one_goes() -> None:
    server = Server()
    pages = [asyncio.create_task(server.visit()) for _ in range(SOCKETS)]
    other = asyncio.create_task(server.visit(who="luis"))
    await asyncio.sleep(0)
    late = await server.visit()
    server.goes.set()
    codes = await asyncio.gather(*pages, other)

    assert late == TOO_MANY_SOCKETS
    assert codes == [0] * (SOCKETS + 1)
    assert await server.visit() == 0
