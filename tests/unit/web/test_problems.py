"""Every error becomes one honest problem and tells nothing of the inside."""

from collections.abc import AsyncIterator
from typing import Annotated

import httpx
import pytest
from fastapi import Body, FastAPI
from pydantic import BaseModel, ConfigDict
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from iveg.domain.errors import (
    DataFileError,
    HopError,
    IvegError,
    UnknownRobotError,
    UnreadableError,
)
from iveg.web.problems import (
    Page,
    Problem,
    install,
    problem_of,
)

Client = httpx.AsyncClient


class Threshold(BaseModel):
    model_config = ConfigDict(strict=True, allow_inf_nan=False)

    value: float


def browse(page: Page | None = None) -> Client:
    app = FastAPI()
    install(app, page)

    @app.post("/threshold")
    async def threshold(body: Annotated[Threshold, Body()]) -> None: ...

    @app.get("/api/v1/boom")
    async def boom() -> None:
        raise ZeroDivisionError("the secret of the inside")

    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    return Client(transport=transport, base_url="http://iveg.test")


@pytest.fixture
async def client() -> AsyncIterator[Client]:
    async with browse() as client:
        yield client


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (UnreadableError("not_json", "line 1"), 400),
        (UnknownRobotError("R9"), 404),
        (HopError("orion", "http://10.0.0.7:1026 refused"), 503),
        (DataFileError("a.json", "", "broken"), 500),
        (IvegError("unforeseen"), 500),
    ],
)
def test_each_error_has_its_status(error: Exception, status: int) -> None:
    assert problem_of(error).status == status


def test_a_broken_hop_keeps_its_address_inside() -> None:
    problem = problem_of(HopError("orion", "http://10.0.0.7:1026 refused"))

    assert "10.0.0.7" not in str(problem)
    assert problem.extra == {"hop": "orion"}


async def test_a_problem_is_problem_json(client: Client) -> None:
    answer = await client.get("/nowhere")

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["cache-control"] == "no-store"
    assert answer.json() == {
        "type": "about:blank",
        "title": "Not Found",
        "status": 404,
        "detail": "Not Found",
    }


@pytest.mark.parametrize(
    "body",
    [b'{"value": NaN}', b'{"value": "12345678"}', b"[]"],
)
async def test_what_is_readable_but_invalid_says_where_and_never_echoes_it(
    client: Client, body: bytes
) -> None:
    headers = {"Content-Type": "application/json"}
    answer = await client.post("/threshold", content=body, headers=headers)

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["where"].startswith("body")
    assert "12345678" not in answer.text
    assert "NaN" not in answer.text


async def test_a_person_gets_a_page_and_a_program_never() -> None:
    def page(request: Request, problem: Problem) -> Response:
        return PlainTextResponse(f"page {problem.status}", problem.status)

    async with browse(page) as client:
        person = await client.get("/nowhere", headers={"Accept": "text/html,*/*"})
        api = await client.get("/api/v1/boom", headers={"Accept": "text/html"})

    assert person.text == "page 404"
    assert api.json()["status"] == 500
    assert "secret" not in api.text
