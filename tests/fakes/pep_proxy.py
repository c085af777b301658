"""A PEP proxy before an embedded FIWARE, with the token endpoint that it trusts.

It answers as FIWARE's Wilma does (repository ging/fiware-pep-proxy): a request without
a token, with one that is over or that nobody gave is 401, one without the role is
refused with its own words; all else passes through to what stands behind.
"""

import asyncio
import base64
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from urllib.parse import parse_qs

import httpx
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from tests.processes import NO_TLS

CLIENT, SECRET = "iveg", "a-secret-of-the-client"
USER, PASSWORD = "iveg@coop.test", "a-password-of-the-user"
_METHODS = ["GET", "POST", "PUT", "PATCH", "DELETE"]


@dataclass
class FakePepProxy:
    """Proxy and token endpoint.

    Attributes:
        behind: Address of what stands behind.
        mono: The clock by which tokens end (s).
        life_s: Of each token (s); ``says`` is what it tells of that, if not the same.
        header: Which it reads; Wilma prefers ``Authorization``.
        vice: What goes wrong; empty: nothing.
        given: Tokens so far, newest last; ``forms`` as they were asked for.
        seen: Token of each request, and the answer's status.
    """

    behind: str
    mono: Callable[[], float]
    life_s: float = 3600.0
    says: object = None
    header: str = "Authorization"
    vice: str = ""
    given: dict[str, float] = field(default_factory=dict)
    forms: list[dict[str, str]] = field(default_factory=list)
    seen: list[tuple[str, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._numbers = itertools.count(1)
        self.is_released = asyncio.Event()

    def revoke(self) -> None:
        """No token that was given counts any more."""
        self.given.clear()

    def app(self) -> Starlette:
        """The application."""
        return Starlette(
            routes=[
                Route("/oauth2/token", self._token, methods=["POST"]),
                Route("/{path:path}", self._pass, methods=_METHODS),
            ]
        )

    async def _token(self, request: Request) -> Response:
        form = {k: v[0] for k, v in parse_qs((await request.body()).decode()).items()}
        self.forms.append(form)
        if self.vice == "hangs":
            await self.is_released.wait()
        if self.vice == "down":
            return JSONResponse({"error": "server_error"}, 503)
        if self.vice == "no_token":
            return JSONResponse({"access_token": "a b\r\nX: 1", "expires_in": 60})
        login = base64.b64encode(f"{CLIENT}:{SECRET}".encode()).decode()
        is_client = request.headers.get("authorization") == f"Basic {login}"
        is_user = form.get("grant_type") == "client_credentials" or (
            (form.get("username"), form.get("password")) == (USER, PASSWORD)
        )
        if not is_client or not is_user:
            return JSONResponse({"error": "invalid_client"}, 401)
        text = f"token-{next(self._numbers)}"
        self.given[text] = self.mono() + self.life_s
        told = {"access_token": text, "token_type": "bearer"}
        life = self.life_s if self.says is None else self.says
        return JSONResponse({**told, "expires_in": life})

    async def _pass(self, request: Request) -> Response:
        said = request.headers.get(self.header.lower(), "")
        token = said.removeprefix("Bearer ") if self.header == "Authorization" else said
        if token not in self.given or self.mono() >= self.given[token]:
            return self._refuse(token, 401, "Invalid token: access token is invalid")
        if self.vice == "no_role":
            return self._refuse(token, 403, "User access-token not authorized")
        headers = {
            name: value
            for name, value in request.headers.items()
            if name not in ("host", "content-length", "connection")
        }
        async with httpx.AsyncClient(base_url=self.behind, verify=NO_TLS) as client:
            answer = await client.request(
                request.method,
                request.url.path,
                params=dict(request.query_params),
                headers=headers,
                content=await request.body(),
            )
        self.seen.append((token, answer.status_code))
        kept = {
            name: value
            for name, value in answer.headers.items()
            if name in ("content-type", "fiware-total-count", "location")
        }
        return Response(answer.content, answer.status_code, kept)

    def _refuse(self, token: str, status: int, why: str) -> Response:
        self.seen.append((token, status))
        told = {"type": "urn:dx:as:InvalidRole", "title": "Unauthorized", "detail": why}
        return JSONResponse(told, status)
