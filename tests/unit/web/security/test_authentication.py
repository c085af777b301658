"""Who the door lets in, and to what."""

from collections.abc import AsyncIterator
from http.cookies import SimpleCookie
from typing import Annotated

import httpx
import pytest
from fastapi import APIRouter, Depends, FastAPI
from fastapi.routing import iter_route_contexts
from starlette.requests import Request
from starlette.responses import Response

from iveg.web import problems
from iveg.web.security.authentication import Authenticator
from iveg.web.security.requirements import require
from iveg.web.security.roles import MAY, Action, Principal
from tests.fakes.clock import FakeClock
from tests.fakes.doors import authenticator as door
from tests.routes import declared_action

Client = httpx.AsyncClient

SIGN_IN = "0123456789abcdef" * 2
API = "a-program-and-its-token"
HOUR = 3600.0


@pytest.fixture
def clock() -> FakeClock:
    return FakeClock()


@pytest.fixture
def authenticator(clock: FakeClock) -> Authenticator:
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


async def test_the_right_link_signs_in_whatever_wrong_ones_nobody_quotes_came_before(
    client: Client, caplog: pytest.LogCaptureFixture
) -> None:
    for _ in range(50):
        await enter(client, "guess-after-guess")

    assert (await enter(client, SIGN_IN)).status_code == 204
    assert "guess" not in caplog.text


async def test_whoever_has_to_wait_to_sign_in_can_stop_all_the_same(
    operator: Client,
) -> None:
    for _ in range(6):
        await enter(operator, "wrong")

    answers = {
        (await operator.post("/stop", headers=OWN)).status_code for _ in range(50)
    }

    assert answers == {200}


async def test_a_stranger_is_told_how_to_sign_in(client: Client) -> None:
    answer = await client.post("/stop", headers=OWN)

    assert answer.status_code == 401
    assert answer.headers["www-authenticate"] == "Bearer"
    assert answer.json()["type"] == "urn:iveg:not-signed-in"


async def test_without_the_setting_no_token_is_accepted(clock: FakeClock) -> None:
    transport = httpx.ASGITransport(build_app(door(clock, link="")))
    async with Client(transport=transport, base_url="http://i") as client:
        bearer = await client.get("/read", headers={"Authorization": "Bearer "})
        link = await enter(client, "")

    assert bearer.status_code == 401
    assert "set-cookie" not in link.headers


async def test_f42_an_ended_session_stops_from_our_own_page_alone(
    operator: Client, clock: FakeClock
) -> None:
    clock.now += 13 * HOUR

    statuses = [
        (await operator.post("/stop")).status_code,
        (await operator.post("/release", headers=OWN)).status_code,
        (await operator.get("/read")).status_code,
    ]

    assert statuses == [403, 403, 403]


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 403),
        ({"Sec-Fetch-Site": "same-origin"}, 403),
        ({"X-IVEG": "1"}, 403),
        ({"X-IVEG": "1", "Sec-Fetch-Site": "cross-site"}, 403),
        ({"X-IVEG": "1", "Origin": "http://evil.test"}, 403),
        ({"X-IVEG": "1", "Origin": "http://iveg.test:81"}, 403),
        (OWN, 200),
        ({"X-IVEG": "1", "Sec-Fetch-Site": "none"}, 200),
        ({"X-IVEG": "1", "Origin": "http://iveg.test"}, 200),
        ({"X-IVEG": "1", "Origin": "https://IVEG.test"}, 200),
    ],
)
async def test_a_cookie_alone_proves_nothing_on_a_post(
    operator: Client, headers: dict[str, str], status: int
) -> None:
    answer = await operator.post("/stop", headers=headers)

    assert answer.status_code == status
    assert status == 200 or answer.json()["type"] == "urn:iveg:foreign-origin"


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
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    guarded = APIRouter(dependencies=[Depends(require("read"))])
    for owner, prefix in ((app.router, "/open"), (guarded, "/guarded")):
        owner.add_api_route(prefix, lambda: None)
        owner.add_api_websocket_route(f"{prefix}/live", lambda: None)
    app.include_router(guarded)

    declared = [declared_action(one) for one in iter_route_contexts(app.routes)]
    assert declared == [None, None, "read", "read"]
