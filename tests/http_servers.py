"""An HTTP server of a test: one function answers every request."""

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import starlette.requests
import starlette.responses
from starlette.types import Receive, Scope, Send

from iveg.lab.embedded import server


@dataclass(frozen=True, slots=True)
class Request:
    """One request; the names of its headers are in lower case."""

    method: str
    path: str
    query: dict[str, str]
    headers: dict[str, str]
    body: bytes


@dataclass(frozen=True, slots=True)
class Response:
    """One answer."""

    status: int
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    content_type: str = "application/json"


Handler = Callable[[Request], Awaitable[Response]]


@asynccontextmanager
async def http_server(handler: Handler, host: str, port: int) -> AsyncIterator[int]:
    """Serve while the block lasts; yields the port in use."""

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        asked = starlette.requests.Request(scope, receive)
        body = await asked.body()
        headers, query = dict(asked.headers), dict(asked.query_params)
        request = Request(asked.method, asked.url.path, query, headers, body)
        told = await handler(request)
        answer = starlette.responses.Response(
            told.body, told.status, told.headers, told.content_type
        )
        await answer(scope, receive, send)

    async with server.http_server(app, host, port) as used:
        yield used
