"""No question is so odd that the server fails: it is answered, or refused as 4xx."""

from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import httpx
import pytest
from fastapi import FastAPI

from iveg.adapters.history.engine import history_url, upgrade
from iveg.app import App
from iveg.asgi import create_app
from iveg.settings import Settings

MOMENTS = ("0001-01-01T00:00:00", "9999-12-31T23:59:59-14:00", "2026-02-30", "1e400")
DAYS = ("0001-01-01", "9999-12-31", "1969-12-31", "0001-01-01T00:00:00+14:00")
TEXTS = ("", "\x00", "[", "9" * 400, "nan", "W251bGwsMV0=")
ODD = {"since": MOMENTS, "until": MOMENTS, "day": DAYS}


@pytest.fixture
def app(tmp_path: Path) -> FastAPI:
    upgrade(history_url(None, tmp_path))
    return create_app(App(Settings(), tmp_path))


@pytest.fixture
async def operator(app: FastAPI) -> AsyncIterator[httpx.AsyncClient]:
    cookie = app.state.authenticator.sessions.open("ana", "operator")
    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    async with httpx.AsyncClient(
        transport=transport,
        base_url="http://iveg.test",
        headers={"Cookie": f"iveg={cookie}"},
    ) as client:
        yield client


def questions(app: FastAPI) -> Iterator[str]:
    """Each parameter of each question with each odd value."""
    yield from (f"/day?day={quote(day)}" for day in DAYS)
    paths: dict[str, dict[str, Any]] = app.openapi()["paths"]
    for path, verbs in paths.items():
        told = verbs.get("get", {}).get("parameters", ())
        for name in (one["name"] for one in told if one["in"] == "query"):
            for value in ODD.get(name, TEXTS):
                yield f"{path.replace('{', '').replace('}', '')}?{name}={quote(value)}"


async def test_no_value_of_a_parameter_makes_the_server_fail(
    app: FastAPI, operator: httpx.AsyncClient
) -> None:
    asked = list(questions(app))

    failed = [one for one in asked if (await operator.get(one)).status_code >= 500]

    assert len(asked) > 200
    assert failed == []


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://[::1"},
        {"Host": "["},
        {"Accept": "text/html;q=1e999,,;="},
        {"Accept-Language": "es;q=nan,;;"},
    ],
)
async def test_no_header_makes_the_server_fail(
    operator: httpx.AsyncClient, headers: dict[str, str]
) -> None:
    for path in ("/", "/signin", "/api/v1/robots", "/api/v1/users"):
        assert (await operator.get(path, headers=headers)).status_code < 500
    press = await operator.post("/api/v1/fleet/stop", headers={"X-IVEG": "1"} | headers)
    assert press.status_code < 500
