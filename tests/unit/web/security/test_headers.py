"""What binds browsers and what is too large."""

from collections.abc import AsyncIterator

import httpx
import pytest
from fastapi import FastAPI, Request

from iveg.web import problems
from iveg.web.security.headers import (
    CONTENT_SECURITY_POLICY,
    MAX_BODY,
    Bounds,
)

Client = httpx.AsyncClient


def build_app() -> FastAPI:
    app = FastAPI()
    problems.install(app)

    @app.api_route("/api/v1/size", methods=["GET", "POST"])
    @app.get("/")
    @app.get("/static/js/main.js")
    async def size(request: Request) -> int:
        return len(await request.body())

    return app


@pytest.fixture
async def client() -> AsyncIterator[Client]:
    app = Bounds(build_app())
    transport = httpx.ASGITransport(app)
    async with Client(transport=transport, base_url="http://i") as client:
        yield client


@pytest.mark.parametrize(
    ("path", "kept"),
    [
        ("/", "no-store"),
        ("/nowhere", "no-store"),
        ("/static/js/main.js", "no-cache"),
        ("/api/v1/size", "no-store"),
    ],
)
async def test_every_answer_binds_the_browser_and_data_is_never_stored(
    client: Client, path: str, kept: str
) -> None:
    answer = await client.get(path)
    by_tls = await client.get(f"https://i{path}")

    headers = answer.headers
    assert headers["cache-control"] == kept
    assert headers["content-security-policy"] == CONTENT_SECURITY_POLICY
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-opener-policy"] == "same-origin"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "strict-transport-security" not in headers
    assert by_tls.headers["strict-transport-security"] == "max-age=31536000"


def test_the_policy_allows_nothing_inline_and_no_other_host() -> None:
    policy = CONTENT_SECURITY_POLICY

    assert "script-src 'self';" in policy
    assert "default-src 'none'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "require-trusted-types-for 'script'" in policy
    assert "http" not in policy
    assert "unsafe" not in policy
    assert "blob:" not in policy


async def test_a_declared_body_over_the_limit_is_refused_unread(
    client: Client,
) -> None:
    answer = await client.post("/api/v1/size", content=b"x" * (MAX_BODY + 1))

    assert answer.status_code == 413
    assert answer.headers["connection"] == "close"
    assert answer.headers["content-type"] == "application/problem+json"


async def test_a_streamed_body_over_the_limit_is_refused_while_it_comes(
    client: Client,
) -> None:
    async def stream() -> AsyncIterator[bytes]:
        for _ in range(11):
            yield b"x" * (MAX_BODY // 10)

    answer = await client.post("/api/v1/size", content=stream())

    assert answer.status_code == 413
    assert answer.json()["title"] in ("Content Too Large", "Request Entity Too Large")
