"""An identity provider on loopback, and its vices.

It speaks HTTP, keeps PKCE and its codes, signs by RSA or EC, and shows a page on which
a browser signs in.
"""

import asyncio
import base64
import contextlib
import hashlib
import hmac
import html
import json
import secrets
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any
from urllib.parse import parse_qs, urlencode, urlsplit

from joserfc import jwt
from joserfc.jwk import ECKey, OctKey, RSAKey
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import (
    HTMLResponse,
    JSONResponse,
    RedirectResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Route

from tests.fakes.serving import served
from tests.ports import free_ports

CLIENT, SECRET = "iveg", "a-secret-of-the-client"
KEYCLOAK = {
    "preferred_username": "ana",
    "name": "Ana Núñez",
    "realm_access": {"roles": ["offline_access", "growers"]},
}

_PAGE = """<!doctype html><title>Provider</title><form method="post" action="/login">
<input type="hidden" name="asked" value="{}"><label>Name <input name="who"></label>
<button>Enter</button></form>"""


def _new_key(kind: str = "RSA") -> RSAKey | ECKey:
    if kind == "RSA":
        return RSAKey.generate_key(2048, auto_kid=True)
    return ECKey.generate_key("P-256", auto_kid=True)


_first_key = cache(_new_key)
"""Making one takes a while."""


@dataclass
class FakeIdentityProvider:
    """One provider.

    Attributes:
        people: Subject → claims.
        vice: What it does wrong; empty: nothing.
        id_token: Changes the claims of the next ID token.
        also: Changes its description.
        asked: Paths that were asked for, and forms that came to the token endpoint.
    """

    url: str
    people: dict[str, dict[str, Any]]
    wall: Callable[[], float] = time.time
    alg: str = "RS256"
    vice: str = ""
    id_token: dict[str, Any] = field(default_factory=dict)
    also: dict[str, Any] = field(default_factory=dict)
    in_user_info: bool = False
    asked: list[str] = field(default_factory=list)
    forms: list[dict[str, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.key = _first_key("EC" if self.alg.startswith("ES") else "RSA")
        self.published = [self.key]
        self._codes: dict[str, tuple[str, dict[str, str]]] = {}
        self._tokens: dict[str, str] = {}

    def rotate(self) -> None:
        """Sign by another key."""
        self.key = _new_key("EC" if self.alg.startswith("ES") else "RSA")
        self.published.append(self.key)

    def approve(self, address: str, who: str) -> str:
        """What the provider's page does: where a browser goes that was sent here."""
        query = {k: v[0] for k, v in parse_qs(urlsplit(address).query).items()}
        assert (query["response_type"], query["client_id"]) == ("code", CLIENT)
        code = secrets.token_urlsafe(16)
        self._codes[code] = (who, query)
        answer = {"code": code, "state": query["state"]}
        return f"{query['redirect_uri']}?{urlencode(answer)}"

    def app(self) -> Starlette:
        """The application."""
        return Starlette(
            routes=[
                Route("/.well-known/openid-configuration", self._about),
                Route("/keys", self._keys),
                Route("/authorize", self._authorize),
                Route("/login", self._login, methods=["POST"]),
                Route("/token", self._token, methods=["POST"]),
                Route("/userinfo", self._user_info),
            ]
        )

    async def _vice(self, request: Request) -> Response | None:
        self.asked.append(request.url.path)
        vice, _, where = self.vice.partition(" ")
        if where and where != request.url.path:
            return None
        match vice:
            case "slow":
                await asyncio.sleep(30.0)
            case "huge":
                return StreamingResponse(_endless(), media_type="application/json")
            case "loop":
                return RedirectResponse(str(request.url), 302)
            case "away":
                return JSONResponse({"error": "server_error"}, 503)
        return None

    async def _about(self, request: Request) -> Response:
        if (bad := await self._vice(request)) is not None:
            return bad
        about = {
            "issuer": self.url,
            "authorization_endpoint": f"{self.url}/authorize",
            "token_endpoint": f"{self.url}/token",
            "jwks_uri": f"{self.url}/keys",
            "userinfo_endpoint": f"{self.url}/userinfo",
        }
        if self.vice == "wrong_issuer":
            about["issuer"] = "https://somebody-else.test"
        if self.vice == "plain_http":
            about["token_endpoint"] = "http://169.254.169.254/latest"
        if self.vice == "endless_address":
            about["token_endpoint"] = f"https://somebody-else.test/{'a' * 70_000}"
        return JSONResponse(about | self.also)

    async def _keys(self, request: Request) -> Response:
        if (bad := await self._vice(request)) is not None:
            return bad
        keys = [{**one.as_dict(private=False), "use": "sig"} for one in self.published]
        if self.vice == "many_keys":
            keys = [{**keys[0], "kid": str(n)} for n in range(10_000)]
        if self.vice == "large_key":
            keys[0]["n"] = "_" * 40_000
        return JSONResponse({"keys": keys})

    async def _authorize(self, request: Request) -> Response:
        self.asked.append(request.url.path)
        return HTMLResponse(_PAGE.format(html.escape(str(request.url))))

    async def _login(self, request: Request) -> Response:
        form = _form(await request.body())
        return RedirectResponse(self.approve(form["asked"], form["who"]), 303)

    async def _token(self, request: Request) -> Response:
        if (bad := await self._vice(request)) is not None:
            return bad
        form = _form(await request.body())
        self.forms.append(form)
        login = base64.b64encode(f"{CLIENT}:{SECRET}".encode()).decode()
        who, asked = self._codes.pop(form["code"], ("", {}))
        challenge = hashlib.sha256(form["code_verifier"].encode()).digest()
        is_theirs = (
            request.headers.get("authorization") == f"Basic {login}"
            and form["redirect_uri"] == asked.get("redirect_uri")
            and asked["code_challenge"] == _encoded(challenge).decode()
        )
        if not is_theirs:
            return JSONResponse({"error": "invalid_grant"}, 400)
        access = secrets.token_urlsafe(16)
        self._tokens[access] = who
        told = {"access_token": access, "token_type": "bearer", "expires_in": 300}
        name = "userinfo" if self.vice == "unsigned" else "id_token"
        told[name] = self._signed(who, asked["nonce"])
        return JSONResponse(told)

    def _signed(self, who: str, nonce: str) -> str:
        now = int(self.wall())
        claims: dict[str, Any] = {
            "iss": self.url,
            "sub": who,
            "aud": CLIENT,
            "iat": now,
            "exp": now + 300,
            "nonce": nonce,
        }
        if not self.in_user_info:
            claims |= self.people[who]
        claims |= self.id_token
        claims = {name: value for name, value in claims.items() if value is not None}
        header = {"alg": self.alg, "kid": self.key.kid}
        match self.vice:
            case "none":
                return b".".join([_part({"alg": "none"}), _part(claims), b""]).decode()
            case "shared_secret":
                secret = OctKey.import_key(SECRET + "x" * 32)
                return jwt.encode({"alg": "HS256"}, claims, secret, ["HS256"])
            case "public_key_as_secret":
                # By hand: a library refuses to sign so.
                header["alg"] = "HS256"
                parts = [_part(header), _part(claims)]
                public = self.key.as_pem(private=False)
                mac = hmac.digest(public, b".".join(parts), "sha256")
                return b".".join([*parts, _encoded(mac)]).decode()
            case "foreign_key":
                return jwt.encode(header, claims, _new_key())
            case "no_token":
                return "not.a.token"
        return jwt.encode(header, claims, self.key, [self.alg])

    async def _user_info(self, request: Request) -> Response:
        if (bad := await self._vice(request)) is not None:
            return bad
        token = request.headers.get("authorization", "").removeprefix("Bearer ")
        who = self._tokens.get(token)
        if who is None:
            return JSONResponse({"error": "invalid_token"}, 401)
        sub = "somebody-else" if self.vice == "other_user_info" else who
        told = self.people[who] if self.in_user_info else {}
        return JSONResponse({**told, "sub": sub})


@contextlib.asynccontextmanager
async def serving(provider: FakeIdentityProvider) -> AsyncIterator[None]:
    """The provider, while the test runs."""
    address = urlsplit(provider.url)
    async with served(provider.app(), address.port or 0, address.hostname or ""):
        yield


def own_url() -> str:
    """An address on loopback that nobody else has."""
    (port,) = free_ports(1)
    return f"http://127.0.0.1:{port}"


def _form(body: bytes) -> dict[str, str]:
    return {k: v[0] for k, v in parse_qs(body.decode()).items()}


def _part(told: dict[str, Any]) -> bytes:
    return _encoded(json.dumps(told).encode())


def _encoded(part: bytes) -> bytes:
    return base64.urlsafe_b64encode(part).rstrip(b"=")


def _endless() -> Iterator[bytes]:
    yield b'{"a": "'
    for _ in range(10_000):
        yield b"a" * 65536
