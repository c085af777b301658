"""Bounds of the server's HTTP: heads, half-sent requests, and STOP beside them."""

import asyncio
import contextlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from iveg.adapters.connection_caps import ConnectionCaps
from iveg.adapters.connections import ConnectionTable
from iveg.web.security.connections import proxies
from tests.unit.web.desk import API_TOKEN, SECRET, TENANT, WebDesk

HEAD_BYTES = ConnectionCaps().head_bytes
MUCH = 2 * HEAD_BYTES  # the parser holds a piece more than the limit
HALF = b"GET / HTTP/1.1\r\nHost: iveg\r\n"
STOP = (
    "POST /api/v1/robots/AGI/stop HTTP/1.1\r\nHost: iveg\r\nContent-Length: 0\r\n"
    f"Authorization: Bearer {API_TOKEN}\r\n\r\n"
).encode()


class Line:
    """A connection, byte for byte."""

    def __init__(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._reader, self._writer = reader, writer

    def say(self, data: bytes) -> "Line":
        self._writer.write(data)
        return self

    async def status(self) -> int:
        """Of the next answer."""
        return int((await self._reader.readuntil(b"\r\n")).split()[1])

    async def is_closed(self) -> bool:
        """Whether the server closes it, after whatever it still says."""
        with contextlib.suppress(ConnectionError):
            await self._reader.read()
        return True

    def close(self) -> None:
        self._writer.close()


class Caller:
    """Opens connections to one server."""

    def __init__(self, place: str) -> None:
        self._host, _, port = place.partition(":")
        self._port = int(port)
        self.lines: list[Line] = []

    async def open(self) -> Line:
        line = Line(*await asyncio.open_connection(self._host, self._port))
        self.lines.append(line)
        return line


@asynccontextmanager
async def called(desk: WebDesk) -> AsyncIterator[Caller]:
    async with desk.serving() as place, asyncio.timeout(20):
        caller = Caller(place)
        try:
            yield caller
        finally:
            for line in caller.lines:
                line.close()


async def taken(desk: WebDesk, connections: int) -> None:
    """Until the server has so many."""
    async with asyncio.timeout(10):
        while len(desk.table) != connections:  # noqa: ASYNC110 - no event
            await asyncio.sleep(0.005)


def small_desk(**caps: int) -> WebDesk:
    desk = WebDesk()
    desk.table = ConnectionTable(lambda: desk.clock().mono, ConnectionCaps(**caps))
    return desk


@pytest.mark.parametrize(
    "head",
    [
        b"GET /" + b"a" * MUCH,
        b"GET / HTTP/1.1\r\nX: " + b"a" * MUCH,
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * MUCH,
        b"GET / HTTP/1.1\r\nX: " + b"a" * MUCH + b"\r\n\r\n",
        b"\r\n" * MUCH,
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\nX: " + b"a" * MUCH,
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n1;" + b"a" * MUCH,
    ],
    ids=["address", "one", "many", "whole", "blank lines", "trailer", "extension"],
)
@pytest.mark.parametrize("piece", [1000, 100_000])
async def test_a_head_that_is_too_long_is_refused(head: bytes, piece: int) -> None:
    desk = WebDesk()
    async with called(desk) as caller:
        line = await caller.open()
        for start in range(0, len(head), piece):
            line.say(head[start : start + piece])
            await asyncio.sleep(0)
        assert await line.is_closed()
    assert desk.table.counters["connections.head_too_long"] == 1


async def test_a_long_head_below_the_limit_is_read() -> None:
    cookies = b"Cookie: " + b"a" * (HEAD_BYTES - 200)
    async with called(WebDesk()) as caller:
        line = await caller.open()
        line.say(b"GET /signin HTTP/1.1\r\nHost: iveg\r\n" + cookies + b"\r\n\r\n")
        # This desk has no pages: the request went all the way.
        assert await line.status() == 404


async def test_a_request_that_does_not_come_in_time_is_ended() -> None:
    desk = WebDesk()
    async with called(desk) as caller:
        silent, half = await caller.open(), (await caller.open()).say(HALF)
        slow = (await caller.open()).say(HALF + b"Content-Length: 9\r\n\r\n1")
        await taken(desk, 3)
        assert await slow.status() == 404
        desk.clock.now += 5.5
        desk.table.end_overdue()
        assert await silent.is_closed()
        assert await half.is_closed()


async def test_a_stop_gets_through_where_every_place_is_taken_by_half_requests() -> (
    None
):
    desk = small_desk(connections=20, of_strangers=20, of_an_address=10)
    async with called(desk) as caller:
        for _ in range(100):
            (await caller.open()).say(HALF)
        await taken(desk, 10)
        assert await (await caller.open()).say(STOP).status() == 202
    assert desk.table.counters["connections.gave_way"] == 91


async def test_an_open_socket_keeps_its_place_in_a_flood() -> None:
    desk = small_desk(connections=20, of_strangers=20, of_an_address=10)
    upgrade = (
        "GET /live HTTP/1.1\r\nHost: iveg\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: iveg.2\r\n"
        f"Authorization: Bearer {API_TOKEN}\r\n\r\n"
    )
    async with called(desk) as caller:
        page = (await caller.open()).say(upgrade.encode())
        assert await page.status() == 101
        for _ in range(100):
            (await caller.open()).say(HALF)
        await taken(desk, 10)
        assert desk.hub.watchers == 1
        page.close()
        await taken(desk, 9)


async def test_orions_connection_keeps_its_place_in_a_flood() -> None:
    desk = small_desk(connections=20, of_strangers=20, of_an_address=10)
    words = {"X-Iveg-Notify-Token": SECRET, **TENANT, "Content-Length": "2"}
    head = "".join(f"{name}: {value}\r\n" for name, value in words.items())
    post = f"POST /ngsi/notifications HTTP/1.1\r\nHost: iveg\r\n{head}\r\n[]".encode()
    async with called(desk) as caller:
        orion = (await caller.open()).say(post)
        assert await orion.status() == 400
        for _ in range(100):
            (await caller.open()).say(HALF)
        await taken(desk, 10)
        assert orion.say(post)
        assert not await is_ended(orion)


async def is_ended(line: Line) -> bool:
    """Whether nothing but the end comes."""
    return await line._reader.read(1) == b""


async def test_what_cannot_be_read_is_one_line_in_the_log(
    caplog: pytest.LogCaptureFixture,
) -> None:
    desk = WebDesk()
    async with called(desk) as caller:
        statuses = [
            await (await caller.open()).say(b"nonsense\r\n\r\n").status()
            for _ in range(5)
        ]
    assert statuses == [400] * 5
    assert caplog.messages == [
        "connections of 127.0.0.1: a request that cannot be read is refused"
    ]
    assert desk.table.counters == {"connections.unreadable": 5}


@pytest.mark.parametrize(
    ("given", "address", "is_proxy"),
    [
        ("127.0.0.1,::1", "127.0.0.1", True),
        ("127.0.0.1,::1", "::1", True),
        ("10.0.0.0/24, proxy.example", "10.0.0.9", True),
        ("10.0.0.0/24, proxy.example", "10.0.1.9", False),
        ("10.0.0.0/24", "2001:db8::1", False),
        ("*", "192.0.2.1", True),
        ("", "127.0.0.1", False),
        ("127.0.0.1", "no address", False),
    ],
)
def test_who_is_a_proxy_is_what_the_setting_says(
    given: str, address: str, is_proxy: bool
) -> None:
    assert proxies(given)(address) is is_proxy
