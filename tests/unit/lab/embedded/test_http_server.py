import asyncio
import contextlib
from collections.abc import AsyncIterator

import pytest

from iveg.lab.embedded.http_server import Request, Response, http_server
from iveg.lab.embedded.routes import Routes


async def echo(request: Request) -> Response:
    """Says what it was asked."""
    return Response(200, request.body or request.path.encode(), content_type="text/x")


@pytest.fixture
async def port() -> AsyncIterator[int]:
    async with http_server(echo, "127.0.0.1", 0) as port:
        yield port


async def said(port: int, sent: bytes) -> bytes:
    """All that the server says until it closes, or has nothing more to say."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(sent)
    writer.write_eof()
    async with asyncio.timeout(10):
        told = await reader.read()
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()
    return told


async def test_requests_sent_ahead_are_answered_in_order(port: int) -> None:
    told = await said(
        port,
        b"GET /a%20b?x=1 HTTP/1.1\r\n\r\n"
        b"POST / HTTP/1.1\r\ncontent-LENGTH: 2\r\n\r\nok"
        b"HEAD /c HTTP/1.1\r\n\r\n",
    )
    head = b"HTTP/1.1 200 OK\r\nContent-Type: text/x\r\nContent-Length: %d\r\n\r\n"
    assert told == head % 4 + b"/a b" + head % 2 + b"ok" + head % 2


@pytest.mark.parametrize(
    "sent",
    [b"GET / HTTP/1.0\r\n\r\n", b"GET / HTTP/1.1\r\nConnection: close\r\n\r\n"],
)
async def test_a_client_of_one_request_is_told_the_end(port: int, sent: bytes) -> None:
    told = await said(port, sent + b"GET / HTTP/1.1\r\n\r\n")
    assert told.count(b"HTTP/1.1 200 OK") == 1
    assert b"\r\nConnection: close\r\n" in told


@pytest.mark.parametrize(
    ("head", "status"),
    [
        (b"nonsense", b"400"),
        (b"GET / HTTP/2", b"400"),
        (b"POST / HTTP/1.1\r\nTransfer-Encoding: chunked", b"411"),
        (b"POST / HTTP/1.1\r\nContent-Length: -1", b"411"),
        (b"POST / HTTP/1.1\r\nContent-Length: 9000000", b"413"),
        (b"POST / HTTP/1.1\r\nContent-Length: " + b"9" * 5000, b"413"),
        (b"GET /" + b"a" * 20_000, b"431"),
    ],
)
async def test_what_cannot_be_read_is_refused_and_ends_the_connection(
    port: int, head: bytes, status: bytes
) -> None:
    told = await said(port, head + b"\r\n\r\n")
    assert told.startswith(b"HTTP/1.1 " + status)


async def test_half_a_request_is_not_answered(port: int) -> None:
    assert await said(port, b"POST / HTTP/1.1\r\nContent-Length: 5\r\n\r\nhal") == b""


def test_a_path_has_the_methods_of_its_rows_in_their_order() -> None:
    routes = Routes({"POST /a": 1, "GET /a": 2, "GET /a/*": 3, "GET /a/*/b": 4})
    assert list(routes.of_path(("a",))) == ["POST", "GET"]
    assert routes.of_path(("a", "x")) == {"GET": 3}
    assert routes.of_path(("a", "x", "b")) == {"GET": 4}
    assert routes.of_path(("b",)) == {}
