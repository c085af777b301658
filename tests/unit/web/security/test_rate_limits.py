"""How much is too much, and that STOP never is."""

import asyncio
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


def test_an_allowance_is_used_up_and_comes_back_with_time() -> None:
    allowance = Allowance(5.0, 1 / 60, now=0.0)

    assert [allowance.admit(0.0) for _ in range(6)] == [True] * 5 + [False]
    assert allowance.wait_s(20.0) == pytest.approx(40.0)
    assert [allowance.admit(61.0) for _ in range(2)] == [True, False]
    assert [allowance.admit(1e6) for _ in range(6)] == [True] * 5 + [False]


@dataclass
class Browser:
    """One socket of a page, without a network."""

    queue: asyncio.Queue[Message] = field(default_factory=asyncio.Queue)
    sent: list[Message] = field(default_factory=list)

    async def receive(self) -> Message:
        return await self.queue.get()

    async def send(self, message: Message) -> None:
        self.sent.append(message)

    def say(self, text: str) -> None:
        self.queue.put_nowait({"type": "websocket.receive", "text": text})

    @property
    def code(self) -> int | None:
        closed = [it["code"] for it in self.sent if it["type"] == "websocket.close"]
        return closed[0] if closed else None


@dataclass
class Server:
    """Takes down what it hears, until the page leaves."""

    heard: list[str] = field(default_factory=list)

    async def __call__(self, _: Scope, receive: Receive, send: Send) -> None:
        await receive()
        await send({"type": "websocket.accept"})
        while (message := await receive())["type"] != "websocket.disconnect":
            self.heard.append(message["text"])


@dataclass
class Bench:
    clock: FakeClock = field(default_factory=FakeClock)
    server: Server = field(default_factory=Server)
    tasks: list[asyncio.Task[None]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.limits = SocketLimits(self.server, self.identify, self.clock)

    def identify(self, connection: HTTPConnection) -> Principal | None:
        name = connection.headers["cookie"]
        if name == "program":
            return Principal(name, "program")
        return Principal(name, "viewer", session=name.encode())

    async def open(self, who: str = "ana") -> Browser:
        browser = Browser()
        browser.queue.put_nowait({"type": "websocket.connect"})
        scope: Scope = {"type": "websocket", "headers": [(b"cookie", who.encode())]}
        serving = self.limits(scope, browser.receive, browser.send)
        self.tasks.append(asyncio.create_task(serving))
        await settle(browser)
        return browser

    def flood(self, page: Browser, text: str) -> None:
        """More than the limit, at once."""
        for _ in range(2 * int(MESSAGES_PER_S)):
            page.say(text)

    async def close(self) -> None:
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


async def settle(page: Browser) -> None:
    """Until all that it said was read."""
    for _ in range(20):
        await asyncio.sleep(0)
    while not page.queue.empty():  # noqa: ASYNC110 - no event
        await asyncio.sleep(0)


async def test_what_a_page_says_beyond_the_limit_is_not_heard() -> None:
    bench = Bench()
    page = await bench.open()
    bench.flood(page, PING)
    await settle(page)
    at_once = len(bench.server.heard)
    bench.clock.now += 0.5
    bench.flood(page, PING)
    await settle(page)
    await bench.close()

    assert at_once == MESSAGES_PER_S
    assert len(bench.server.heard) == MESSAGES_PER_S * 1.5


async def test_i11_a_stop_is_heard_from_a_page_that_says_too_much() -> None:
    bench = Bench()
    page = await bench.open()
    bench.flood(page, PING)
    for _ in range(50):
        page.say(STOP)
    await settle(page)
    await bench.close()

    assert bench.server.heard.count(STOP) == 50


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "ping", "t": "\\"stop\\""}',
        '{"type": "stop"',
        '{"type": "stop", "robot_id": "' + "A" * 5000 + '"}',
    ],
)
async def test_what_only_looks_like_a_stop_is_limited(text: str) -> None:
    bench = Bench()
    page = await bench.open()
    bench.flood(page, text)
    await settle(page)
    await bench.close()

    assert len(bench.server.heard) == MESSAGES_PER_S


async def test_a_socket_beyond_twenty_of_a_session_is_refused_until_one_goes() -> None:
    bench = Bench()
    pages = [await bench.open() for _ in range(SOCKETS)]
    late = await bench.open()
    other = await bench.open("luis")
    pages[0].queue.put_nowait({"type": "websocket.disconnect"})
    await settle(pages[0])
    again = await bench.open()
    await bench.close()

    assert late.code == TOO_MANY_SOCKETS
    assert [page.code for page in (*pages, other, again)] == [None] * (SOCKETS + 2)
