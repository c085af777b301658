"""HTTP to Orion and the IoT Agent: their headers, pages, failures, and their bearer.

A PEP proxy before them may require a token.  Both share a token of one endpoint (OAuth
2.0; FIWARE Keyrock's ``/oauth2/token``), which is fetched before the first request::

    none ──fetch──> held ──at 80 % of its life: fetched beside requests──> held anew
      ^               └──refused (401), or expired──> fetched while requests wait
      └── not given: requests fail with that cause, and never leave without a bearer

One fetch serves all requests that wait; after a failure the next comes after a pause.
"""

import asyncio
import logging
import socket
import ssl
from collections.abc import AsyncGenerator, Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from http import HTTPStatus
from typing import Annotated, Any, ClassVar, Final, Literal, Self

import httpx
import orjson
from pydantic import BaseModel, Field, TypeAdapter, ValidationError

from iveg.adapters.bounded_json import BoundedJson
from iveg.domain.errors import HopError, NoAnswerError
from iveg.domain.wire import OR_NONE

HOP: Final = "token"
_PART_OF_LIFE: Final = 0.8
_PAUSE_S: Final = 2.0
"""Time between a failure and the next request for a token (s)."""
_REFUSED_S: Final = 5.0
"""Time after a refused token in which a refusal fetches no other (s)."""
_DEFAULT_LIFE_S: Final = 300.0
"""Life of a token whose endpoint gives no ``expires_in`` (s)."""
_log = logging.getLogger(__name__)

TokenHeader = Literal["Authorization", "X-Auth-Token"]


@dataclass(frozen=True, slots=True)
class TokenGrant:
    """Request for a token.

    Attributes:
        url: Address of the token endpoint.
        client_id: Name of iVeg there, with its ``secret``.
        user: With ``password``: iVeg acts as this user (password grant); empty: as
            itself (client credentials).  Keyrock's token by client credentials has no
            roles, so a PEP proxy that checks roles needs a user.
        header: Header that the proxy reads.
    """

    url: str
    client_id: str
    secret: str = field(repr=False)
    user: str = ""
    password: str = field(default="", repr=False)
    scope: str = ""
    header: TokenHeader = "Authorization"

    @property
    def form(self) -> dict[str, str]:
        """Form to post (RFC 6749, 4.3.2 and 4.4.2)."""
        form = {"grant_type": "client_credentials"}
        if self.user:
            form = {
                "grant_type": "password",
                "username": self.user,
                "password": self.password,
            }
        return form | ({"scope": self.scope} if self.scope else {})


class _Answer(BaseModel):
    """Answer of a token endpoint; the token must fit into a header."""

    access_token: Annotated[str, Field(pattern=r"^[\x21-\x7e]{1,16384}$")]
    expires_in: Annotated[Annotated[float, Field(gt=0, le=86400)] | None, OR_NONE] = (
        None
    )


class FiwareToken(httpx.Auth):
    """Fetches the token, renews it, and sends requests with it.

    Args:
        grant: The request for it.
        mono: The monotonic clock (s).
        http: HTTP to the endpoint.
    """

    def __init__(
        self, grant: TokenGrant, mono: Callable[[], float], http: BoundedJson
    ) -> None:
        self._grant, self._mono, self._http = grant, mono, http
        self._drop()
        self._asking: asyncio.Task[None] | None = None
        self._error = ""
        self._again_at = self._refused_at = float("-inf")

    def _drop(self) -> None:
        self._text = ""
        self._renew_at = self._ends_at = float("-inf")

    async def async_auth_flow(
        self, request: httpx.Request
    ) -> AsyncGenerator[httpx.Request, httpx.Response]:
        """Send a request with a token; once more after a 401.  Raises HopError.

        A refused request has not reached the neighbour, so a repetition arrives once.
        """
        # Less than the request's own time, so that the error names the token endpoint.
        patience_s = _TOKEN_PART * request.extensions["timeout"]["read"]
        token = await self._in_time(patience_s)
        response = yield self._carrying(request, token)
        is_refused = response.status_code == HTTPStatus.UNAUTHORIZED
        if is_refused and self._may_be_replaced(token):
            yield self._carrying(request, await self._in_time(patience_s))

    async def _in_time(self, patience_s: float) -> str:
        try:
            # Not `wait_for`, which in Python 3.11 may swallow a cancellation.
            async with asyncio.timeout(patience_s):
                return await self._current()
        except TimeoutError as error:
            raise HopError(HOP, "no answer yet") from error

    def _carrying(self, request: httpx.Request, token: str) -> httpx.Request:
        is_bearer = self._grant.header == "Authorization"
        request.headers[self._grant.header] = f"Bearer {token}" if is_bearer else token
        return request

    async def _current(self) -> str:
        """A token that has not expired.  Raises HopError: there is none."""
        now = self._mono()
        is_asking = self._asking is not None and not self._asking.done()
        if now >= max(self._renew_at, self._again_at) and not is_asking:
            # A task: while the old token lasts, no request waits for the new one.
            self._asking = asyncio.create_task(self._renew(), name="fiware-token")
        if now >= self._ends_at and self._asking is not None:
            # Shielded: a request that gives up must not cancel the others' fetch.
            await asyncio.shield(self._asking)
            if self._error:
                raise HopError(HOP, self._error)
        return self._text

    def _may_be_replaced(self, refused: str) -> bool:
        """Whether another token may succeed after this one was refused.

        Wilma also answers 401 to a known user without a role: no token helps there.
        """
        if self._text == refused:
            now = self._mono()
            if now - self._refused_at < _REFUSED_S:
                return False
            self._refused_at = now
            self._drop()
        return True

    async def close(self) -> None:
        """Close the connection to the endpoint."""
        if self._asking is not None:
            self._asking.cancel()
            await asyncio.gather(self._asking, return_exceptions=True)
        await self._http.close()

    async def _renew(self) -> None:
        began = self._mono()
        try:
            answer = await self._fetch()
        except HopError as error:
            if not self._error:
                _log.warning("no bearer for Orion and the agent: %s", error)
            self._error, self._again_at = error.detail, self._mono() + _PAUSE_S
            return
        life_s = answer.expires_in or _DEFAULT_LIFE_S
        self._text, self._error = answer.access_token, ""
        self._renew_at, self._ends_at = began + _PART_OF_LIFE * life_s, began + life_s

    async def _fetch(self) -> _Answer:
        grant = self._grant
        login = grant.client_id, grant.secret
        answer = await self._http.post(grant.url, grant.form, login)
        if not answer.is_success:
            raise HopError(HOP, answer.refusal)
        try:
            return _Answer.model_validate(answer.body)
        except ValidationError:
            # Without the cause, which would show the answer, maybe with a token.
            raise HopError(HOP, "answered no token") from None


_NODELAY = [(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)]
_KEPT_S = 2.0
"""Longest idle time of a connection that is kept (s).  Node.js, and so the IoT
Agent, closes it after 5 s; a request that crosses the closing gets no answer."""
_MOST_CONNECTIONS = 100
PAGE_SIZE = 100
TIMEOUT_S = 6.0
"""Time limit of a request (s): more than the 5 s that Orion waits for a hung agent."""
PROBE_TIMEOUT_S = 3.0
"""Time limit of a question that a healthy neighbour answers in milliseconds (s)."""
_MOST_PAGES = 100
NO_TOKEN = "token endpoint down"  # noqa: S105 - a cause
"""Beginning of the cause where a request did not leave for want of a token."""
_TOKEN_PART = 0.9

Document = dict[str, Any]
_OBJECT: TypeAdapter[Document] = TypeAdapter(Document)
_OBJECTS: TypeAdapter[list[Document]] = TypeAdapter(list[Document])
MEANINGLESS = "answered something that means nothing here"


@cache
def _trusted() -> ssl.SSLContext:
    """Trusted certificates, read once for all neighbours: a read takes 25 ms of CPU."""
    return httpx.create_ssl_context()


class FiwareHttp:
    """HTTP to one neighbour with FIWARE's headers; ``async with`` closes it.

    Failures are ``HopError``.

    Args:
        url: Address without a path.
        service: ``Fiware-Service``.
        path: ``Fiware-ServicePath``.
        access: Token for a proxy before the neighbour; None: without.

    Attributes:
        HOP: Name of the neighbour in errors.
    """

    HOP: ClassVar[str]

    def __init__(
        self,
        url: str,
        service: str,
        path: str,
        access: FiwareToken | None = None,
    ) -> None:
        self._access = access
        self._client = httpx.AsyncClient(
            auth=access,
            base_url=url,
            headers={
                "Accept": "application/json",
                "Fiware-Service": service,
                "Fiware-ServicePath": path,
            },
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
        """Send one request; returns the response.

        Args:
            method: HTTP method.
            path: Path with a leading slash.
            query: Parameters.
            body: Sent as JSON unless None.
            timeout_s: Time limit of the whole exchange (s).
            also: Statuses beside 2xx that the caller understands.

        Raises:
            NoAnswerError: no answer in time.
            HopError: no connection, no token for a proxy, or another status.
        """
        try:
            # httpx's own limit counts anew with each byte that trickles in.
            async with asyncio.timeout(timeout_s):
                response = await self._client.request(
                    method,
                    path,
                    params=dict(query or {}),
                    json=body,
                    timeout=timeout_s,
                )
        except HopError as error:
            raise HopError(self.HOP, f"{NO_TOKEN}: {error.detail}") from error
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

    async def create(self, path: str, body: Document) -> bool:
        """Create something; False where it already exists.  Raises HopError."""
        response = await self.ask("POST", path, body=body, also=(HTTPStatus.CONFLICT,))
        return response.is_success

    async def delete(self, path: str, query: Mapping[str, str] | None = None) -> None:
        """Delete something; its absence is no error.  Raises HopError."""
        await self.ask("DELETE", path, query=query, also=(HTTPStatus.NOT_FOUND,))

    def read_object(self, response: httpx.Response) -> Document:
        """Read an answer that is an object.  Raises HopError: it is not."""
        try:
            return _OBJECT.validate_json(response.content)
        except ValidationError as error:
            raise HopError(self.HOP, MEANINGLESS) from error

    async def read_all(
        self, path: str, query: Mapping[str, str] | None = None, part: str = ""
    ) -> list[Document]:
        """Every object of a list, page by page, up to 100 pages.

        Args:
            path: Path of the list.
            query: Parameters of each page.
            part: Member of the agent's answer that holds the list.

        Raises:
            HopError: no answer, or an unreadable answer.
        """
        objects: list[Document] = []
        for _ in range(_MOST_PAGES):
            page = {"limit": str(PAGE_SIZE), "offset": str(len(objects))}
            response = await self.ask("GET", path, query={**(query or {}), **page})
            try:
                answer = orjson.loads(response.content)
                rows = _OBJECTS.validate_python(answer[part] if part else answer)
            except (ValueError, LookupError, TypeError) as error:
                raise HopError(self.HOP, MEANINGLESS) from error
            objects += rows
            if len(rows) < PAGE_SIZE:
                break
        return objects


def _complaint(method: str, path: str, response: httpx.Response) -> str:
    """Short reason of a refusal; each neighbour has another name for it."""
    body: Document = {}
    with suppress(ValidationError):
        body = _OBJECT.validate_json(response.content)
    # ``detail`` is a PEP proxy's.
    words = (str(body.get(w) or "") for w in ("description", "message", "detail"))
    reason = next(filter(None, words), "")[:160]
    refusal = f"{response.status_code} to {method} {path}"
    return f"{refusal}: {reason}" if reason else refusal
