"""JSON over HTTP from a server that somebody has configured, and that may be hostile.

Time, size and threads are bounded; redirects are followed nowhere, and a body comes as
it is, so that no small one unpacks into a large one.
"""

import asyncio
import socket
import ssl
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from typing import Final

import httpx
import orjson

from iveg.domain.errors import HopError, NoAnswerError
from iveg.domain.records import Json

TIMEOUT_S: Final = 5.0
MOST_BYTES: Final = 256 * 1024
_THREADS: Final = 2


@dataclass(frozen=True, slots=True)
class JsonAnswer:
    """Status and object of an answer; the object is empty where there is none."""

    status: int
    body: Json

    @property
    def is_success(self) -> bool:
        """Whether the status is 2xx."""
        return 200 <= self.status < 300

    @property
    def refusal(self) -> str:
        """Status and OAuth error code; a description may hold anything."""
        code = self.body.get("error")
        known = isinstance(code, str) and code.isascii() and code.isprintable()
        return f"{self.status} {str(code)[:40]}" if known else str(self.status)


class BoundedJson:
    """Asks one server.

    Args:
        hop: Names the server in errors.
        timeout_s: For each exchange as a whole (s), however slowly it trickles.
    """

    def __init__(self, hop: str, timeout_s: float = TIMEOUT_S) -> None:
        self._hop, self._timeout_s = hop, timeout_s
        self._names = ThreadPoolExecutor(_THREADS, "names")
        self._client = httpx.AsyncClient(
            transport=_OwnNames(self._names),
            timeout=timeout_s,
            headers={"Accept": "application/json", "Accept-Encoding": "identity"},
        )

    async def close(self) -> None:
        """Close connections and threads."""
        await self._client.aclose()
        self._names.shutdown(wait=False, cancel_futures=True)

    async def get(
        self,
        url: str,
        query: Mapping[str, str] | None = None,
        headers: Mapping[str, str] | None = None,
    ) -> JsonAnswer:
        """GET an object. Raises HopError."""
        return await self._ask("GET", url, params=query, headers=headers)

    async def post(
        self,
        url: str,
        form: Mapping[str, str],
        login: tuple[str, str] | None = None,
    ) -> JsonAnswer:
        """POST a form, with a user and password where there is a login.

        Raises:
            HopError: no answer in time, or none that is a JSON object of some size.
        """
        auth = None if login is None else httpx.BasicAuth(*login)
        return await self._ask("POST", url, data=dict(form), auth=auth)

    async def _ask(self, method: str, url: str, **what: object) -> JsonAnswer:
        asked = {name: value for name, value in what.items() if value is not None}
        try:
            async with asyncio.timeout(self._timeout_s):
                # mypy cannot follow arguments by name into the library.
                async with self._client.stream(method, url, **asked) as answer:  # type: ignore[arg-type]
                    body = await self._read(answer)
        except (TimeoutError, httpx.TimeoutException) as error:
            detail = f"no answer in {self._timeout_s:g} s"
            raise NoAnswerError(self._hop, detail) from error
        except (httpx.HTTPError, httpx.InvalidURL, OSError, UnicodeError) as error:
            # Of the address nothing: its query may hold a token.
            why = type(error).__name__
            raise HopError(self._hop, f"cannot be reached: {why}") from None
        return JsonAnswer(answer.status_code, self._object(answer.status_code, body))

    async def _read(self, answer: httpx.Response) -> bytes:
        body = bytearray()
        async for part in answer.aiter_raw():
            body += part
            if len(body) > MOST_BYTES:
                detail = f"answered more than {MOST_BYTES} bytes"
                raise HopError(self._hop, detail)
        return bytes(body)

    def _object(self, status: int, body: bytes) -> Json:
        try:
            document = orjson.loads(body)
        except ValueError:
            document = None
        if isinstance(document, dict):
            return document
        if 200 <= status < 300:
            raise HopError(self._hop, "answered something that is no JSON object")
        return {}


@cache
def _believed() -> ssl.SSLContext:
    """Certificates of this machine; reading them takes a while."""
    return ssl.create_default_context()


class _OwnNames(httpx.AsyncBaseTransport):
    """Connections whose names are resolved in threads of their own.

    A name server that hangs would otherwise take the threads of everything else.
    """

    def __init__(self, names: ThreadPoolExecutor) -> None:
        self._names = names
        self._inner = httpx.AsyncHTTPTransport(verify=_believed())

    async def handle_async_request(self, request: httpx.Request) -> httpx.Response:
        host = request.url.host
        port = request.url.port or (443 if request.url.scheme == "https" else 80)
        loop = asyncio.get_running_loop()
        address = await loop.run_in_executor(self._names, _look_up, host, port)
        # The certificate is checked against the name, and Host keeps it.
        request.extensions["sni_hostname"] = host
        request.url = request.url.copy_with(host=address)
        return await self._inner.handle_async_request(request)

    async def aclose(self) -> None:
        await self._inner.aclose()


def _look_up(host: str, port: int) -> str:
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    # An address of a link is written with its interface: fe80::1%eth0.
    return str(found[0][4][0]).partition("%")[0]
