"""HTTP to Orion and the IoT Agent: their headers, their pages, their failures."""

import asyncio
import socket
import ssl
from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import cache
from http import HTTPStatus
from typing import Any, ClassVar, Self, TypeVar

import httpx
import orjson

from iveg.adapters.fiware_token import FiwareToken
from iveg.domain.errors import HopError, NoAnswerError

_NODELAY = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
_KEPT_S = 2.0
"""A connection unused for longer is not used again: Node.js, and so the IoT Agent,
closes it after 5 s, and a request that crosses the closing on its way has no answer."""
_MOST_CONNECTIONS = 100
PAGE_SIZE = 100
TIMEOUT_S = 6.0
"""A little more than the five seconds that Orion waits for a hung agent."""
PROBE_TIMEOUT_S = 3.0
"""For a question that a healthy neighbour answers in milliseconds."""
_MOST_PAGES = 100
_COUNTED = {"options": "count"}
NO_TOKEN = "token endpoint down"  # noqa: S105 - a cause
"""Begins the cause where a request did not leave, as no token could be had."""
_TOKEN_PART = 0.9

Document = dict[str, Any]
_T = TypeVar("_T")


@cache
def _trusted() -> ssl.SSLContext:
    """Certificates, read once for all neighbours: 25 ms of a processor each time."""
    return httpx.create_ssl_context()


class FiwareHttp:
    """HTTP to one neighbour, as FIWARE speaks it; ``async with`` closes it.

    Failures are ``HopError``.

    Args:
        url: Address without a path.
        service: ``Fiware-Service``.
        path: ``Fiware-ServicePath``.
        access: Where a proxy before it asks for a token; None: none does.
        bearer: Token that is sent along; empty for none.

    Attributes:
        HOP: Names the neighbour in errors.
    """

    HOP: ClassVar[str]

    def __init__(
        self,
        url: str,
        service: str,
        path: str,
        access: FiwareToken | None = None,
        *,
        bearer: str = "",
    ) -> None:
        self._access = access
        headers = {"Fiware-Service": service, "Fiware-ServicePath": path}
        if bearer:
            headers["Authorization"] = f"Bearer {bearer}"
        self._client = httpx.AsyncClient(
            base_url=url,
            headers=headers,
            timeout=TIMEOUT_S,
            transport=httpx.AsyncHTTPTransport(
                verify=_trusted(),
                limits=httpx.Limits(
                    max_connections=_MOST_CONNECTIONS, keepalive_expiry=_KEPT_S
                ),
                socket_options=_NODELAY,
            ),
        )

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def close(self) -> None:
        """Close the kept connections, and those of the token, which others share."""
        await self._client.aclose()
        if self._access is not None:
            await self._access.close()

    async def ask(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        body: object = None,
        timeout_s: float = TIMEOUT_S,
        also: Sequence[int] = (),
    ) -> httpx.Response:
        """One request.

        Args:
            method: HTTP method.
            path: With a leading slash.
            query: Parameters.
            body: Sent as JSON unless None.
            timeout_s: For the whole exchange (s), however slowly it trickles.
            also: Statuses beside 2xx that the caller understands.

        Raises:
            NoAnswerError: no answer in time.
            HopError: no connection, no token for a proxy, or another status.
        """

        async def send(token: Mapping[str, str]) -> httpx.Response:
            return await self._client.request(
                method,
                path,
                params=dict(query or {}),
                json=body,
                headers={"Accept": "application/json", **token},
                timeout=timeout_s,
            )

        try:
            async with asyncio.timeout(timeout_s):
                response = await self._admitted(send, timeout_s)
        except (TimeoutError, httpx.TimeoutException) as error:
            raise NoAnswerError(
                self.HOP, f"no answer to {method} {path} in {timeout_s:g} s"
            ) from error
        except httpx.HTTPError as error:
            raise HopError(
                self.HOP, f"cannot be reached: {str(error) or type(error).__name__}"
            ) from error
        if response.is_success or response.status_code in also:
            return response
        raise HopError(self.HOP, _complaint(method, path, response))

    async def _admitted(
        self,
        send: Callable[[Mapping[str, str]], Awaitable[httpx.Response]],
        timeout_s: float,
    ) -> httpx.Response:
        """The answer with a token where one is asked for; once more after a 401.

        What a proxy refused has not reached the neighbour: sent again, it comes once.
        """
        if self._access is None:
            return await send({})
        token = await self._token(self._access.current(), timeout_s)
        response = await send(self._access.header(token))
        if response.status_code != HTTPStatus.UNAUTHORIZED:
            return response
        other = await self._token(self._access.after(token), timeout_s)
        return response if other is None else await send(self._access.header(other))

    async def _token(self, asked: Awaitable[_T], timeout_s: float) -> _T:
        # A little less than the whole, so that it is known what was waited for.
        try:
            # Not `wait_for`, which in Python 3.11 may swallow a cancellation.
            async with asyncio.timeout(_TOKEN_PART * timeout_s):
                return await asked
        except TimeoutError as error:
            raise HopError(self.HOP, f"{NO_TOKEN}: no answer yet") from error
        except HopError as error:
            raise HopError(self.HOP, f"{NO_TOKEN}: {error.detail}") from error

    def read(self, response: httpx.Response) -> object:
        """The JSON of an answer.

        Raises:
            HopError: it is not JSON.
        """
        try:
            return orjson.loads(response.content)
        except ValueError as error:
            raise HopError(self.HOP, "answered something that is not JSON") from error

    def read_object(self, response: httpx.Response) -> Document:
        """The object that is an answer.

        Raises:
            HopError: it is anything else.
        """
        document = self.read(response)
        if not isinstance(document, dict):
            raise self._meaningless()
        return document

    def read_list(self, response: httpx.Response, part: str = "") -> list[Document]:
        """The list of objects in an answer, or in one part of it.

        Raises:
            HopError: it is anything else.
        """
        rows = self.read_object(response).get(part) if part else self.read(response)
        if not isinstance(rows, list) or not all(isinstance(one, dict) for one in rows):
            raise self._meaningless()
        return rows

    async def read_all(
        self, path: str, query: Mapping[str, str] = _COUNTED, part: str = ""
    ) -> list[Document]:
        """Every object of a list, page by page; one without an end is left.

        Args:
            path: Where the list is.
            query: Parameters of each page.
            part: Of the agent's answer, which holds the total beside it.

        Raises:
            HopError: no answer, or none that means anything.
        """
        found: list[Document] = []
        for _ in range(_MOST_PAGES):
            page = {**query, "limit": str(PAGE_SIZE), "offset": str(len(found))}
            response = await self.ask("GET", path, query=page)
            rows = self.read_list(response, part)
            found += rows
            total = self._total(response, of_agent=bool(part))
            if not rows or len(found) >= total:
                break
        return found

    def _total(self, response: httpx.Response, *, of_agent: bool) -> int:
        """The total number, as the neighbour reports it."""
        about = self.read_object(response) if of_agent else response.headers
        counted = about.get("count" if of_agent else "Fiware-Total-Count", 0)
        try:
            return int(counted)
        except (TypeError, ValueError) as error:
            raise HopError(self.HOP, f"counted {counted!r} of something") from error

    def _meaningless(self) -> HopError:
        return HopError(self.HOP, "answered JSON that means nothing here")


def _complaint(method: str, path: str, response: httpx.Response) -> str:
    """The reason of a refusal, short; each neighbour uses another word."""
    said = ""
    try:
        body = orjson.loads(response.content)
    except ValueError:
        body = None
    if isinstance(body, dict):
        # ``detail`` is a PEP proxy's.
        words = ("description", "message", "detail")
        said = next((str(body[one]) for one in words if body.get(one)), "")[:160]
    refused = f"{response.status_code} to {method} {path}"
    return f"{refused}: {said}" if said else refused
