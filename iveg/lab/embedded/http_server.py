"""A small HTTP/1.1 server with keep-alive: request in, response out.

Orion and the agent set their own headers, refuse bodies before reading them and send no
``Server`` header, which web frameworks do not allow easily.
"""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from http import HTTPStatus
from urllib.parse import parse_qsl, unquote, urlsplit

import httptools
import orjson

from iveg.adapters import clock
from iveg.adapters.connections import Connection, ConnectionCaps, ConnectionTable

_log = logging.getLogger(__name__)
_MAX_BODY = 8 << 20
_MAX_WAITING = 64
_PIECE = 8192


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


@dataclass(frozen=True, slots=True)
class Response:
    """One answer; ``Content-Length`` is added."""

    status: int
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    content_type: str = "application/json"


def json_response(value: object, status: int = 200) -> Response:
    """A response with a JSON body."""
    return Response(status, orjson.dumps(value))


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
    connections: set[_Connection] = set()  # from the first byte to the last response
    table = ConnectionTable(clock.mono, ConnectionCaps.on_loopback())
    server = await asyncio.get_running_loop().create_server(
        lambda: _Connection(handler, connections, table), host, port
    )
    ending = asyncio.create_task(table.run(), name="embedded-late-requests")
    try:
        yield server.sockets[0].getsockname()[1]
    finally:
        ending.cancel()
        server.close()
        tasks = [connection.close() for connection in list(connections)]
        await asyncio.gather(*tasks, return_exceptions=True)
        await server.wait_closed()


class _HeadTooLongError(Exception):
    """Leaves the parser."""


class _Connection(asyncio.Protocol):
    """One client: bytes → requests → handler, in order → bytes."""

    def __init__(
        self,
        handler: Handler,
        connections: "set[_Connection]",
        table: ConnectionTable,
    ) -> None:
        self._handler = handler
        self._connections = connections
        self._table = table
        self._place: Connection | None = None
        self._head = self._unparsed = 0
        self._requests: asyncio.Queue[tuple[Request, bool] | None] = asyncio.Queue()
        self._parser = httptools.HttpRequestParser(self)
        self._transport: asyncio.Transport | None = None
        self._task: asyncio.Task[None] | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = transport  # type: ignore[assignment]
        peer = transport.get_extra_info("peername") or ("",)
        self._place = self._table.admit(peer[0], transport.abort)  # type: ignore[attr-defined]
        if self._place is None:
            transport.close()
        self._connections.add(self)
        self._task = asyncio.get_running_loop().create_task(
            self._answer_all(), name="embedded-http-connection"
        )

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        """The client disconnected; its request is still executed."""
        self._transport = None
        self._requests.put_nowait(None)
        if self._place is not None:
            self._place.leave()

    async def close(self) -> None:
        """Close the connection and wait until its handler has ended."""
        if self._transport is not None:
            self._transport.abort()
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task

    def data_received(self, data: bytes) -> None:
        for start in range(0, len(data), _PIECE):
            if self._transport is None or self._transport.is_closing():
                return
            self._feed(data[start : start + _PIECE])

    def _feed(self, data: bytes) -> None:
        self._unparsed += len(data)
        try:
            self._parser.feed_data(data)
            if self._unparsed > self._table.caps.head_bytes:
                raise _HeadTooLongError
        except (httptools.HttpParserError, UnicodeDecodeError, ValueError) as error:
            is_long = isinstance(error.__context__, _HeadTooLongError)
            self._refuse(431 if is_long else 400)
        except _HeadTooLongError:
            self._refuse(431)

    def _refuse(self, status: int) -> None:
        if self._transport is not None:
            told = f"HTTP/1.1 {status} {HTTPStatus(status).phrase}\r\n\r\n"
            self._transport.write(told.encode())
            self._transport.close()

    # --- httptools callbacks ----------------------------------------------------

    def on_message_begin(self) -> None:
        """A request begins."""
        self._url = b""
        self._headers: dict[str, str] = {}
        self._body: list[bytes] = []
        self._size = self._head = self._unparsed = 0
        if self._place is not None:
            self._place.await_head()

    def on_url(self, url: bytes) -> None:
        """Part of the request target."""
        self._count(len(url))
        self._url += url

    def on_header(self, name: bytes, value: bytes) -> None:
        """One header."""
        self._count(len(name) + len(value))
        self._headers[name.decode("latin-1").lower()] = value.decode("latin-1")

    def on_headers_complete(self) -> None:
        """The head is complete."""
        self._unparsed = 0
        if self._place is not None:
            self._place.await_body()

    def on_body(self, body: bytes) -> None:
        """Part of the body; bytes beyond all limits are counted, not stored."""
        self._unparsed = 0
        self._size += len(body)
        if self._size <= _MAX_BODY:
            self._body.append(body)

    def on_message_complete(self) -> None:
        """The request is complete."""
        self._unparsed = 0
        if self._place is not None:
            # Nobody signs in here: who sends whole requests is as good as known.
            self._place.serve()
            self._place.vouch()
        target = urlsplit(self._url.decode("ascii"), allow_fragments=False)
        # Orion requests "//op/update" from agents, which urlsplit would read as a host.
        path = self._url.decode("ascii").partition("?")[0]
        request = Request(
            self._parser.get_method().decode("ascii"),
            unquote(path),
            dict(parse_qsl(target.query, keep_blank_values=True)),
            self._headers,
            b"".join(self._body),
        )
        self._requests.put_nowait((request, self._parser.should_keep_alive()))
        if self._requests.qsize() > _MAX_WAITING and self._transport is not None:
            self._transport.pause_reading()

    def _count(self, size: int) -> None:
        self._unparsed = 0
        self._head += size
        if self._head > self._table.caps.head_bytes:
            raise _HeadTooLongError

    # --- answers ----------------------------------------------------------------

    async def _answer_all(self) -> None:
        try:
            while (asked := await self._requests.get()) is not None:
                request, keep = asked
                response = await self._answer(request)
                self._write(_written(response, request.method, keep), keep=keep)
        finally:
            self._connections.discard(self)

    def _write(self, data: bytes, *, keep: bool) -> None:
        if self._transport is None:
            return
        self._transport.write(data)
        if self._place is not None and self._place.is_busy and self._requests.empty():
            self._place.rest()
        if not keep:
            self._transport.close()
        elif self._requests.qsize() <= _MAX_WAITING:
            self._transport.resume_reading()

    async def _answer(self, request: Request) -> Response:
        try:
            return await self._handler(request)
        except Exception:
            _log.exception("%s %s failed", request.method, request.path)
            return Response(500)


def _written(response: Response, method: str, keep: bool) -> bytes:
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
