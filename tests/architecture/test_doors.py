"""Every door of the finished application is declared, and every document knows it."""

import re
from collections.abc import Iterator
from dataclasses import replace

import httpx
import pytest
from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from starlette.requests import Request

from iveg.app import App
from iveg.asgi import create_app
from iveg.domain.accounts import digest_of
from iveg.settings import Settings
from iveg.web.security.audited import AUDITED, READING
from iveg.web.security.roles import MAY, Action
from iveg.web.security.sessions import LASTS_S
from tests.architecture import documents, security_table
from tests.routes import declared_action

INTERFACES = documents.interfaces()
HEADINGS = documents.named_headings(INTERFACES)
STATIC_FILES = "/static"
API_TOKEN = "a-token-for-programs"
OPEN_TO_STRANGERS = {
    "/healthz",
    "/signin",
    "/ngsi/notifications",
    "/sw.js",
}
"""Notifications have a secret of their own; the service worker is a file like all
scripts below `/static`, and must be at the root."""


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> FastAPI:
    settings = Settings(api_token=API_TOKEN)
    return create_app(App(settings, tmp_path_factory.mktemp("data")))


def test_every_route_and_websocket_declares_a_role(app: FastAPI) -> None:
    assert [path for path, action in _doors(app) if action is None] == []


def test_only_these_are_open_to_strangers(app: FastAPI) -> None:
    assert {path for path, action in _doors(app) if action == "open"} == (
        OPEN_TO_STRANGERS
    )


def test_the_audit_knows_every_route_that_changes_something(app: FastAPI) -> None:
    changing = {
        (method, path)
        for path, methods in _methods(app)
        for method in methods
        if method not in READING
    }

    assert changing - {("POST", "/ngsi/notifications")} == set(AUDITED)


def test_the_table_of_routes_in_the_security_page_is_the_routes(app: FastAPI) -> None:
    page = security_table.PAGE.read_text()

    assert page == security_table.with_table(page, security_table.table(app))


@pytest.mark.parametrize("role", [*MAY, "stranger"])
async def test_every_route_lets_each_role_in_or_not_as_the_table_says(
    app: FastAPI, role: str
) -> None:
    headers, may = _who(app, role), MAY.get(role, frozenset({"open"}))  # type: ignore[call-overload]
    refusal = 401 if role == "stranger" else 403
    authenticator = app.state.authenticator
    wrong = []
    async with _asking(app, headers) as client:
        for path, action, method in _asked(app):
            if action not in may:
                status = (await client.request(method, path)).status_code
                if status != refusal:
                    wrong.append((method, path, status))
            elif action != "open":
                # The handler itself is not what is asked about.
                authenticator.authorise(_request(method, path, headers), action)

    assert wrong == []


def test_what_moves_a_robot_asks_for_more_than_what_stops_it(app: FastAPI) -> None:
    asked = {
        path.rsplit("/", 1)[1]: action
        for path, action in _doors(app)
        if path.startswith(("/api/v1/robots/", "/api/v1/fleet/"))
    }

    assert asked["stop"] == "stop"
    assert asked["release"] == "release"
    assert asked["resume"] == "release"
    assert asked["goal"] == "release"


def test_every_route_of_the_api_has_its_heading_in_the_contract(app: FastAPI) -> None:
    routes = {
        f"{method} {_written(path)}"
        for path, methods in _methods(app)
        for method in methods
        if path.startswith("/api/v1")
    }

    assert routes - HEADINGS == set()


def test_every_other_route_is_in_the_contract(app: FastAPI) -> None:
    others = {path for path, _ in _methods(app) if not path.startswith("/api/v1")}

    assert {path for path in others if f"{_written(path)}`" not in INTERFACES} == set()


def _who(app: FastAPI, role: str) -> dict[str, str]:
    """Headers of somebody of this role."""
    own = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
    if role == "stranger":
        return own
    if role == "program":
        return {"Authorization": f"Bearer {API_TOKEN}"}
    sessions = app.state.authenticator.sessions
    if role != "expired":
        return {**own, "Cookie": f"iveg={sessions.open('ana', role)}"}
    token = sessions.open("ana", "admin")
    digest = digest_of(token)
    known = app.state.authenticator.people.book.sessions
    old = known[digest]
    known[digest] = replace(old, began=old.began - LASTS_S * 1.5)
    return {**own, "Cookie": f"iveg={token}"}


def _asking(app: FastAPI, headers: dict[str, str]) -> httpx.AsyncClient:
    transport = httpx.ASGITransport(app)
    return httpx.AsyncClient(
        transport=transport, base_url="http://iveg.test", headers=headers
    )


def _asked(app: FastAPI) -> Iterator[tuple[str, Action, str]]:
    """Path, action and method of every route of HTTP."""
    for route in iter_route_contexts(app.routes):
        action = declared_action(route)
        if action is None:
            continue
        for method in set(route.methods or ()):
            yield re.sub(r"\{[^}]+\}", "AGI", str(route.path)), action, method


def _request(method: str, path: str, headers: dict[str, str]) -> Request:
    raw = [(name.lower().encode(), one.encode()) for name, one in headers.items()]
    scope = {"type": "http", "method": method, "path": path, "scheme": "http"}
    return Request({**scope, "query_string": b"", "headers": raw})


def _methods(app: FastAPI) -> list[tuple[str, set[str]]]:
    return [
        (str(route.path), set(route.methods or ()))
        for route in iter_route_contexts(app.routes)
        if route.path != STATIC_FILES
    ]


def _doors(app: FastAPI) -> list[tuple[str, Action | None]]:
    return [
        (str(route.path), declared_action(route))
        for route in iter_route_contexts(app.routes)
        if route.path != STATIC_FILES
    ]


def _written(path: str) -> str:
    """How the contract writes a path: below ``/api/v1``, every parameter ``{id}``."""
    return re.sub(r"\{\w+(?::\w+)?\}", "{id}", path.removeprefix("/api/v1"))
