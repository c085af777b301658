"""Signing in by the page: the token comes in a body, from a page of this server."""

from collections.abc import AsyncIterator

import httpx
import pytest
from fastapi import FastAPI

from iveg.domain.detection_rule import DetectionRule
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.openapi import ApiDoc
from iveg.web.pages.routes import router
from iveg.web.problems import install
from iveg.web.security.authentication import Authenticator
from tests.builders import START

TOKEN = "cd" * 32
OWN = {"X-IVEG": "1", "Origin": "http://iveg"}


@pytest.fixture
async def stranger() -> AsyncIterator[httpx.AsyncClient]:
    pages = Pages(Site("field", ("AGI",), "1", demo=False))
    app = FastAPI()
    app.state.authenticator = Authenticator(
        sign_in_token=TOKEN, api_token="", clock=lambda: START
    )
    app.include_router(
        router(pages, document=lambda: ApiDoc("", "", (), ()), rule=DetectionRule)
    )
    install(app, pages.problem)
    async with httpx.AsyncClient(
        transport=httpx.ASGITransport(app), base_url="http://iveg"
    ) as client:
        yield client


async def test_the_token_that_a_page_posts_signs_in(
    stranger: httpx.AsyncClient,
) -> None:
    answer = await stranger.post("/signin", json={"token": TOKEN}, headers=OWN)
    page = await stranger.get("/")

    assert answer.status_code == 204
    assert "HttpOnly" in answer.headers["set-cookie"]
    assert "SameSite=strict" in answer.headers["set-cookie"]
    assert page.status_code == 200


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({"token": "0" * 64}, 401),
        ({"token": ""}, 401),
        ({"token": "a" * 257}, 422),
        ({"token": 1}, 422),
        ({}, 422),
        ([], 422),
    ],
)
async def test_a_wrong_token_signs_nobody_in(
    stranger: httpx.AsyncClient, body: object, status: int
) -> None:
    answer = await stranger.post("/signin", json=body, headers=OWN)

    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert "set-cookie" not in answer.headers


async def test_wrong_tokens_have_to_wait_and_the_right_one_has_not(
    stranger: httpx.AsyncClient,
) -> None:
    wrong = [
        (await stranger.post("/signin", json={"token": "x"}, headers=OWN)).status_code
        for _ in range(7)
    ]
    right = await stranger.post("/signin", json={"token": TOKEN}, headers=OWN)

    assert wrong == [401] * 5 + [429] * 2
    assert right.status_code == 204


@pytest.mark.parametrize(
    "headers", [{}, {"X-IVEG": "1"}, {"X-IVEG": "1", "Origin": "http://evil.test"}]
)
async def test_another_sites_page_signs_nobody_in(
    stranger: httpx.AsyncClient, headers: dict[str, str]
) -> None:
    answer = await stranger.post("/signin", json={"token": TOKEN}, headers=headers)

    assert answer.status_code == 403
    assert "set-cookie" not in answer.headers
