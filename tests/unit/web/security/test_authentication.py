"""Who the door lets in, and to what."""

import logging
from collections.abc import AsyncIterator
from dataclasses import dataclass
from http.cookies import SimpleCookie
from typing import Annotated

import httpx
import pytest
from fastapi import APIRouter, Depends, FastAPI, WebSocket
from fastapi.routing import iter_route_contexts
from starlette.requests import Request
from starlette.responses import Response

from iveg.domain import accounts
from iveg.domain.accounts import AccessBook
from iveg.domain.observations import Instant
from iveg.web import problems
from iveg.web.security.authentication import Authenticator
from iveg.web.security.requirements import declared_action, require
from iveg.web.security.roles import MAY, Action, Principal
from iveg.web.security.sessions import Sessions
from tests.fakes.doors import authenticator as door

Client = httpx.AsyncClient

SIGN_IN = "0123456789abcdef" * 2
API = "a-program-and-its-token"
HOUR = 3600.0


@dataclass
class Clock:
    now: float = 1000.0

    def __call__(self) -> Instant:
        return Instant(self.now, 1e9 + self.now)


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def authenticator(clock: Clock) -> Authenticator:
    return door(clock, SIGN_IN, API)


def build_app(authenticator: Authenticator) -> FastAPI:
    app = FastAPI(openapi_url=None)
    app.state.authenticator = authenticator
    problems.install(app)

    def add(action: Action) -> None:
        @app.api_route(f"/{action}", methods=["GET", "POST"])
        async def route(
            who: Annotated[Principal, Depends(require(action))],
        ) -> dict[str, str]:
            return {"name": who.name, "role": who.role}

    for action in MAY["admin"]:
        add(action)

    @app.post("/signin")
    async def sign_in(request: Request, token: str) -> Response:
        return authenticator.sign_in(request, token)

    return app


@pytest.fixture
async def client(authenticator: Authenticator) -> AsyncIterator[Client]:
    transport = httpx.ASGITransport(build_app(authenticator))
    async with Client(transport=transport, base_url="http://iveg.test") as client:
        yield client


async def enter(client: Client, token: str, base: str = "") -> httpx.Response:
    """What the page of the link does."""
    return await client.post(f"{base}/signin", params={"token": token}, headers=OWN)


@pytest.fixture
async def operator(client: Client) -> Client:
    """A browser that has followed the link."""
    await enter(client, SIGN_IN)
    return client


OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
BEARER = {"Authorization": f"Bearer {API}"}


@pytest.mark.parametrize(
    ("scheme", "name", "secure"), [("http", "iveg", ""), ("https", "__Host-iveg", True)]
)
async def test_the_cookie_is_bound_to_this_site_and_hidden_from_scripts(
    client: Client, scheme: str, name: str, secure: object
) -> None:
    answer = await enter(client, SIGN_IN, f"{scheme}://iveg.test")

    cookie = SimpleCookie(answer.headers["set-cookie"])[name]
    assert len(cookie.value) >= 43
    assert (cookie["httponly"], cookie["samesite"]) == (True, "strict")
    assert (cookie["path"], cookie["secure"]) == ("/", secure)
    assert (await client.get(f"{scheme}://iveg.test/read")).json()["role"] == "operator"


async def test_wrong_tokens_are_told_a_few_times_and_never_quoted(
    client: Client,
    caplog: pytest.LogCaptureFixture,
) -> None:
    for _ in range(50):
        await enter(client, "guess-after-guess")

    records = [r for r in caplog.records if r.levelno == logging.WARNING]
    assert len(records) == 5
    assert "guess" not in caplog.text


async def test_the_right_link_signs_in_however_many_wrong_ones_came_before(
    client: Client,
) -> None:
    for _ in range(50):
        await enter(client, "wrong")

    assert (await enter(client, SIGN_IN)).status_code == 204


async def test_whoever_has_to_wait_to_sign_in_can_stop_all_the_same(
    operator: Client,
) -> None:
    for _ in range(6):
        await enter(operator, "wrong")

    answers = {
        (await operator.post("/stop", headers=OWN)).status_code for _ in range(50)
    }

    assert answers == {200}


@pytest.mark.parametrize(
    ("action", "status"), [("read", 200), ("stop", 200), ("release", 403)]
)
async def test_i8_a_viewer_can_stop_and_cannot_release(
    client: Client, authenticator: Authenticator, action: str, status: int
) -> None:
    client.cookies.set(
        "iveg", authenticator.sessions.open("Ana", "viewer"), domain="iveg.test"
    )

    assert (await client.post(f"/{action}", headers=OWN)).status_code == status


@pytest.mark.parametrize("action", ["read", "stop", "release", "admin"])
async def test_a_stranger_is_told_how_to_sign_in(client: Client, action: str) -> None:
    answer = await client.post(f"/{action}", headers=OWN)

    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"
    assert answer.json()["type"] == "urn:iveg:not-signed-in"


async def test_without_the_setting_no_token_is_accepted(clock: Clock) -> None:
    transport = httpx.ASGITransport(build_app(door(clock, link="")))
    async with Client(transport=transport, base_url="http://i") as client:
        bearer = await client.get("/read", headers={"Authorization": "Bearer "})
        link = await enter(client, "")

    assert bearer.status_code == 401
    assert "set-cookie" not in link.headers


def test_use_prolongs_no_session(clock: Clock) -> None:
    sessions = Sessions(clock, AccessBook())
    token = sessions.open("Ana", "operator")

    roles = []
    for _ in range(4):
        clock.now += 5 * HOUR
        found = sessions.find(token)
        assert found is not None
        roles.append(found.role)

    assert roles == ["operator"] * 2 + ["expired"] * 2


def test_sessions_are_bounded_and_the_oldest_gives_way(
    clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(accounts, "MOST_SESSIONS", 2)
    sessions = Sessions(clock, AccessBook())
    tokens = []
    for name in ("a", "b", "c"):
        tokens.append(sessions.open(name, "viewer"))
        clock.now += 1

    assert [sessions.find(token) is None for token in tokens] == [
        True,
        False,
        False,
    ]


async def test_f42_a_stop_of_an_ended_session_is_written_to_the_log(
    operator: Client, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    clock.now += 13 * HOUR
    with caplog.at_level(logging.INFO):
        answer = await operator.post("/stop", headers=OWN)

    assert answer.status_code == 200
    assert "STOP by operator, whose session is over" in caplog.text


async def test_f42_an_ended_session_stops_from_our_own_page_alone(
    operator: Client, clock: Clock
) -> None:
    clock.now += 13 * HOUR

    statuses = [
        (await operator.post("/stop")).status_code,
        (await operator.post("/release", headers=OWN)).status_code,
        (await operator.get("/read")).status_code,
    ]

    assert statuses == [403, 403, 403]


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Sec-Fetch-Site": "same-origin"},
        {"X-IVEG": "1"},
        {"X-IVEG": "1", "Sec-Fetch-Site": "cross-site"},
        {"X-IVEG": "1", "Origin": "http://evil.test"},
        {"X-IVEG": "1", "Origin": "http://iveg.test:81"},
    ],
)
async def test_a_cookie_alone_proves_nothing_on_a_post(
    operator: Client, headers: dict[str, str]
) -> None:
    answer = await operator.post("/stop", headers=headers)

    assert answer.status_code == 403
    assert answer.json()["type"] == "urn:iveg:foreign-origin"


@pytest.mark.parametrize(
    "headers",
    [
        OWN,
        {"X-IVEG": "1", "Sec-Fetch-Site": "none"},
        {"X-IVEG": "1", "Origin": "http://iveg.test"},
        {"X-IVEG": "1", "Origin": "https://IVEG.test"},
    ],
)
async def test_the_own_page_may_post(operator: Client, headers: dict[str, str]) -> None:
    assert (await operator.post("/stop", headers=headers)).status_code == 200


@pytest.mark.parametrize(
    "content_type",
    ["text/plain", "application/x-www-form-urlencoded", "application/jsonp", ""],
)
async def test_a_body_that_is_not_json_is_refused(
    client: Client, content_type: str
) -> None:
    headers = {**BEARER, "Content-Type": content_type}

    answer = await client.post("/stop", content=b"{}", headers=headers)

    assert answer.status_code == 415


def test_a_route_or_websocket_that_declares_nothing_is_found() -> None:
    router = APIRouter(prefix="/api")
    guarded = APIRouter(dependencies=[Depends(require("read"))])

    for owner in (router, guarded):
        owner.add_api_route("/forgot", lambda: None)
        owner.add_api_websocket_route("/live", forgetful_socket)
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    app.include_router(router)
    app.include_router(guarded)

    declared = {
        one.path: declared_action(one) for one in iter_route_contexts(app.routes)
    }
    assert declared == {
        "/api/forgot": None,
        "/api/live": None,
        "/forgot": "read",
        "/live": "read",
    }


async def forgetful_socket(websocket: WebSocket) -> None:
    """A WebSocket whose author forgot to declare a role."""
