"""A small HTTP/1.1 server with keep-alive: request in, response out.

Orion and the agent set their own headers and send no ``Server`` header, which web
frameworks do not allow easily.
"""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from http import HTTPStatus
from urllib.parse import parse_qsl, unquote

from iveg.adapters import clock
from iveg.adapters.connection_caps import ConnectionCaps
from iveg.adapters.connections import Connection, ConnectionTable

_log = logging.getLogger(__name__)
_MAX_BODY = 8 << 20
_MOST_DIGITS = 10
_CLOSED = (asyncio.IncompleteReadError, ConnectionError)


@dataclass(frozen=True, slots=True)
class Request:
    """One parsed request.

    Attributes:
        path: Decoded, without the query.
        query: Names and decoded values; the last of a name wins.
        headers: Names in lower case.
    """

    method: str
    path: str
    query: dict[str, str]
    headers: dict[str, str]
    body: bytes

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts of the path that are not empty."""
        return tuple(part for part in self.path.split("/") if part)


@dataclass(frozen=True, slots=True)
class Response:
    """One answer; ``Content-Length`` is added."""

    status: int
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    content_type: str = "application/json"


Handler = Callable[[Request], Awaitable[Response]]


@asynccontextmanager
async def http_server(handler: Handler, host: str, port: int) -> AsyncIterator[int]:
    """Serve while the block lasts.

    Args:
        handler: Answers requests, one at a time for each connection.
        host: Address to bind.
        port: TCP port; 0 for a free one.

    Yields:
        The port in use.
    """
    table = ConnectionTable(clock.mono, ConnectionCaps.on_loopback())
    serving: set[asyncio.Task[None]] = set()

    def connected(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.create_task(
            _serve(handler, table, reader, writer), name="embedded-http-connection"
        )
        serving.add(task)
        task.add_done_callback(serving.discard)

    server = await asyncio.start_server(
        connected, host, port, limit=table.caps.head_bytes
    )
    ending = asyncio.create_task(table.run(), name="embedded-late-requests")
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        server.close()
        tasks = [ending, *serving]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await server.wait_closed()


class _RefusedError(Exception):
    """A request that cannot be read; the argument is the status of the answer."""


async def _serve(
    handler: Handler,
    table: ConnectionTable,
    reader: asyncio.StreamReader,
    writer: asyncio.StreamWriter,
) -> None:
    """Answer the requests of one client, in order, until it leaves."""
    peer = writer.get_extra_info("peername") or ("",)
    place = table.admit(peer[0], writer.transport.abort)
    keep = place is not None
    try:
        while keep and place is not None:
            request = await _read(reader, place)
            response = await _answer(handler, request)
            keep = request.headers.get("connection", "").lower() != "close"
            writer.write(_written(response, request.method, keep=keep))
            await writer.drain()
            place.rest()
    except _RefusedError as refused:
        writer.write(_written(Response(refused.args[0]), "", keep=False))
    except _CLOSED:
        pass  # the client has left; what it asked for whole was done
    finally:
        if place is not None:
            place.leave()
        writer.close()


async def _read(reader: asyncio.StreamReader, place: Connection) -> Request:
    """The next request.

    Raises:
        _RefusedError: it is too long, or nothing that can be read.
    """
    first = await reader.readexactly(1)
    place.await_head()
    try:
        head = first + await reader.readuntil(b"\r\n\r\n")
    except asyncio.LimitOverrunError:
        raise _RefusedError(431) from None
    place.await_body()
    request = _parse(head.decode("latin-1"))
    length = request.headers.get("content-length", "0")
    if not length.isdecimal() or "transfer-encoding" in request.headers:
        raise _RefusedError(411)
    if len(length) > _MOST_DIGITS or int(length) > _MAX_BODY:
        raise _RefusedError(413)
    body = await reader.readexactly(int(length))
    # Nobody signs in here: who sends whole requests is as good as known.
    place.serve()
    place.vouch()
    return replace(request, body=body)


def _parse(head: str) -> Request:
    start, *lines = head.strip("\r\n").split("\r\n")
    match start.split(" "):
        case [method, target, version] if version.startswith("HTTP/1."):
            path, _, query = target.partition("?")
        case _:
            raise _RefusedError(400)
    pairs = (line.partition(":") for line in lines)
    headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
    if version == "HTTP/1.0":
        headers.setdefault("connection", "close")
    asked = dict(parse_qsl(query, keep_blank_values=True))
    return Request(method, unquote(path), asked, headers, b"")


async def _answer(handler: Handler, request: Request) -> Response:
    try:
        return await handler(request)
    except Exception:
        _log.exception("%s %s failed", request.method, request.path)
        return Response(500)


def _written(response: Response, method: str, *, keep: bool) -> bytes:
    head = [f"HTTP/1.1 {response.status} {HTTPStatus(response.status).phrase}"]
    if response.body:
        head.append(f"Content-Type: {response.content_type}")
    if response.status != 204:
        head.append(f"Content-Length: {len(response.body)}")
    if not keep:
        head.append("Connection: close")
    head += [f"{name}: {value}" for name, value in response.headers.items()]
    body = b"" if method == "HEAD" else response.body
    return "\r\n".join((*head, "", "")).encode("latin-1") + body
