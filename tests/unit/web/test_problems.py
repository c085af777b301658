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
    CommandRefusedError,
    DataFileError,
    HopError,
    IvegError,
    UnknownRobotError,
    UnreadableError,
)
from iveg.web.problems import (
    ForeignOriginError,
    NotJsonError,
    NotSignedInError,
    Problem,
    install,
    problem_of,
)

Client = httpx.AsyncClient


class Threshold(BaseModel):
    model_config = ConfigDict(strict=True, allow_inf_nan=False)

    value: float


def build_app() -> FastAPI:
    app = FastAPI()

    @app.post("/threshold")
    async def threshold(body: Annotated[Threshold, Body()]) -> None: ...

    @app.get("/api/v1/boom")
    async def boom() -> None:
        raise ZeroDivisionError("the secret of the inside")

    return app


@pytest.fixture
async def client() -> AsyncIterator[Client]:
    app = build_app()
    install(app)
    async with browse(app) as client:
        yield client


def browse(app: FastAPI) -> Client:
    transport = httpx.ASGITransport(app, raise_app_exceptions=False)
    return Client(transport=transport, base_url="http://iveg.test")


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (UnreadableError("not_json", "line 1"), 400),
        (NotSignedInError(), 401),
        (ForeignOriginError("same origin"), 403),
        (UnknownRobotError("R9"), 404),
        (CommandRefusedError("AGI", "release", "not standing"), 409),
        (NotJsonError(), 415),
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
    [b'{"value": NaN}', b'{"value": Infinity}', b'{"value": "12345678"}', b"{}", b"[]"],
)
async def test_what_is_readable_but_invalid_says_where_and_never_echoes_it(
    client: Client, body: bytes
) -> None:
    answer = await post(client, body)

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["where"].startswith("body")
    assert "12345678" not in answer.text
    assert "NaN" not in answer.text
    assert "Infinity" not in answer.text


async def test_a_person_gets_a_page_and_a_program_never() -> None:
    def page(request: Request, problem: Problem) -> Response:
        return PlainTextResponse(f"page {problem.status}", problem.status)

    app = build_app()
    install(app, page)
    async with browse(app) as client:
        person = await client.get("/nowhere", headers={"Accept": "text/html,*/*"})
        script = await client.get("/nowhere", headers={"Accept": "application/json"})
        api = await client.get("/api/v1/boom", headers={"Accept": "text/html"})

    assert person.text == "page 404"
    assert script.json()["status"] == 404
    assert api.json()["status"] == 500
    assert "secret" not in api.text


async def post(client: Client, body: bytes) -> httpx.Response:
    headers = {"Content-Type": "application/json"}
    return await client.post("/threshold", content=body, headers=headers)
