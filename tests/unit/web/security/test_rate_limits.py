"""How much is too much, and that STOP never is."""

import asyncio
from dataclasses import dataclass, field

import pytest
from starlette.requests import HTTPConnection
from starlette.types import Message, Receive, Scope, Send

from iveg.web.security.attempts import FailedAttempts
from iveg.web.security.rate_limits import (
    MESSAGES_PER_S,
    PAINTED_PER_S,
    SOCKETS,
    TOO_MANY_SOCKETS,
    SocketLimits,
)
from iveg.web.security.roles import Principal
from tests.fakes.clock import FakeClock

PING, STOP = '{"type": "ping", "t": 1}', '{"type": "stop", "robot_id": "AGI"}'


def test_five_wrong_links_are_free_and_the_next_waits_a_minute() -> None:
    attempts = FailedAttempts()
    for second in range(5):
        assert attempts.wait_s("10.0.0.1", second) == 0.0
        attempts.failed("10.0.0.1", second)

    assert attempts.wait_s("10.0.0.1", 5.0) == 59.0
    assert attempts.wait_s("10.0.0.1", 64.0) == 0.0


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
        return Principal(name, "viewer", name.encode())

    async def open(self, who: str = "ana") -> Browser:
        browser = Browser()
        browser.queue.put_nowait({"type": "websocket.connect"})
        scope: Scope = {"type": "websocket", "headers": [(b"cookie", who.encode())]}
        serving = self.limits(scope, browser.receive, browser.send)
        self.tasks.append(asyncio.create_task(serving))
        await settle()
        return browser

    async def close(self) -> None:
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


async def settle() -> None:
    for _ in range(20):
        await asyncio.sleep(0)


async def test_what_a_page_says_beyond_twenty_a_second_is_not_heard() -> None:
    bench = Bench()
    page = await bench.open()
    for _ in range(100):
        page.say(PING)
    await settle()
    at_once = len(bench.server.heard)
    bench.clock.now += 0.5
    for _ in range(100):
        page.say(PING)
    await settle()
    await bench.close()

    assert at_once == MESSAGES_PER_S
    assert len(bench.server.heard) == MESSAGES_PER_S * 3 // 2


async def test_what_was_painted_is_counted_apart_and_bounded_too() -> None:
    bench = Bench()
    page = await bench.open()
    for number in range(PAINTED_PER_S + 50):
        page.say(f'{{"type":"painted","frame":{number}}}')
    for number in range(MESSAGES_PER_S + 5):
        page.say(f'{{"type":"ping","t":{number}}}')
    while not page.queue.empty():
        await settle()
    await bench.close()

    painted = [text for text in bench.server.heard if "painted" in text]
    assert len(painted) == PAINTED_PER_S
    assert len(bench.server.heard) - len(painted) == MESSAGES_PER_S


async def test_i11_a_stop_is_heard_from_a_page_that_says_too_much() -> None:
    bench = Bench()
    page = await bench.open()
    for _ in range(100):
        page.say(PING)
    for _ in range(50):
        page.say(STOP)
    await settle()
    await bench.close()

    assert bench.server.heard.count(STOP) == 50


@pytest.mark.parametrize(
    "text",
    [
        '{"type": "ping", "t": "\\"stop\\""}',
        '{"type": "stop"',
        '{"type": "stop", "robot_id": "' + "A" * 5000 + '"}',
        '{"type":"painted","type":"ping"}',
    ],
)
async def test_what_only_looks_like_a_stop_is_limited(text: str) -> None:
    bench = Bench()
    page = await bench.open()
    for _ in range(100):
        page.say(text)
    await settle()
    await bench.close()

    assert len(bench.server.heard) == MESSAGES_PER_S


async def test_a_sixth_socket_of_a_session_is_refused_while_five_are_alive() -> None:
    bench = Bench()
    pages = [await bench.open() for _ in range(SOCKETS)]
    bench.clock.now += 2.0
    sixth = await bench.open()
    other = await bench.open("luis")
    await bench.close()

    assert sixth.code == TOO_MANY_SOCKETS
    assert [page.code for page in pages] == [None] * SOCKETS
    assert other.code is None


async def test_a_silent_socket_gives_way_to_the_page_that_comes_back() -> None:
    bench = Bench()
    pages = [await bench.open() for _ in range(SOCKETS)]
    bench.clock.now += 5.0
    for page in pages[1:]:
        page.say(PING)
    await settle()

    back = await bench.open()
    await settle()
    await bench.close()

    assert back.code is None
    assert pages[0].code == TOO_MANY_SOCKETS
    assert [page.code for page in pages[1:]] == [None] * (SOCKETS - 1)
