"""Bounds of the server's HTTP: heads, half-sent requests, and STOP beside them."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from iveg.web.bounded_http import MOST_HELD, bounded_http
from tests.unit.web.desk import API_TOKEN, WebDesk

MUCH = 8 * MOST_HELD  # the parser holds a piece more than the limit
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


@asynccontextmanager
async def called(desk: WebDesk) -> AsyncIterator[Callable[[], Awaitable[Line]]]:
    """Yields what opens a connection to its server."""
    lines: list[Line] = []
    async with desk.serving() as place, asyncio.timeout(20):
        host, _, port = place.partition(":")

        async def connect() -> Line:
            lines.append(Line(*await asyncio.open_connection(host, int(port))))
            return lines[-1]

        try:
            yield connect
        finally:
            for line in lines:
                line.close()


def small_desk() -> WebDesk:
    desk = WebDesk()
    desk.http = bounded_http(most=10)
    return desk


@pytest.mark.parametrize(
    "head",
    [
        b"GET /" + b"a" * MUCH,
        b"GET / HTTP/1.1\r\nX: " + b"a" * MUCH,
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * MUCH,
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\nX: " + b"a" * MUCH,
        b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n1;" + b"a" * MUCH,
    ],
    ids=["address", "one", "many", "trailer", "extension"],
)
@pytest.mark.parametrize("piece", [10_000, 100_000])
async def test_a_head_that_is_too_long_is_refused(head: bytes, piece: int) -> None:
    desk = WebDesk()
    async with called(desk) as connect:
        line = await connect()
        for start in range(0, len(head), piece):
            line.say(head[start : start + piece])
            await asyncio.sleep(0)
        assert await line.is_closed()
        assert len(desk.http.table) == 0


async def test_a_head_that_does_not_come_in_time_is_ended() -> None:
    desk = WebDesk()
    desk.http = bounded_http(head_s=0.01)
    async with called(desk) as connect:
        assert await (await connect()).is_closed()
        assert await (await connect()).say(HALF).is_closed()
        whole = (await connect()).say(HALF + b"Content-Length: 9\r\n\r\n1")
        assert await whole.status() == 404


async def test_f59_a_stop_gets_through_where_half_requests_take_every_place() -> None:
    """And an open socket keeps its place."""
    desk = small_desk()
    upgrade = (
        "GET /live HTTP/1.1\r\nHost: iveg\r\nConnection: Upgrade\r\n"
        "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
        "Sec-WebSocket-Protocol: iveg.2\r\n"
        f"Authorization: Bearer {API_TOKEN}\r\n\r\n"
    )
    async with called(desk) as connect:
        page = (await connect()).say(upgrade.encode())
        assert await page.status() == 101
        for _ in range(100):
            (await connect()).say(HALF)
        async with asyncio.timeout(10):
            while len(desk.http.table) != 10:  # noqa: ASYNC110 - no event
                await asyncio.sleep(0.005)
        assert await (await connect()).say(STOP).status() == 202
        assert len(desk.hub.subscribers) == 1


async def test_the_oldest_idle_connection_goes_before_one_that_is_answered() -> None:
    desk = small_desk()
    held, began = asyncio.Event(), asyncio.Event()

    async def slow(_: Request) -> Response:
        began.set()
        await held.wait()
        return Response(status_code=204)

    desk.app.router.routes.insert(0, Route("/healthz", slow))
    async with called(desk) as connect:
        busy = (await connect()).say(HALF.replace(b"/ ", b"/healthz ") + b"\r\n")
        await began.wait()
        idle = await connect()
        for _ in range(9):
            (await connect()).say(HALF)
        assert await idle.is_closed()
        held.set()
        assert await busy.status() == 204
