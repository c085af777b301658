"""What people and programs do is in the audit, by whom and with what came of it."""

import json

import pytest
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route

from iveg.domain.records import AuditRecord
from iveg.domain.stop import Press
from iveg.web.security.roles import Principal
from tests.unit.web.desk import WebDesk

LINK = "cd" * 32


@pytest.fixture
def desk() -> WebDesk:
    return WebDesk()


def audited(desk: WebDesk) -> list[AuditRecord]:
    return desk.records(AuditRecord)


def only(desk: WebDesk) -> tuple[AuditRecord, dict[str, object]]:
    (row,) = audited(desk)
    return row, json.loads(row.details)


async def test_a_stop_is_written_with_who_how_and_which_command(desk: WebDesk) -> None:
    async with desk.browser("viewer") as page:
        answer = await page.post("/api/v1/robots/AGI/stop", json={"press_id": "p1"})

    row, details = only(desk)
    assert (row.name, row.role, row.method) == ("ana", "viewer", "link")
    assert (row.action, row.subject, row.at) == ("stop", "AGI", desk.clock().wall)
    assert details == {
        "status": 202,
        "press_id": "p1",
        "command_id": answer.json()["command_id"],
    }


async def test_a_stop_on_the_socket_is_written_too(desk: WebDesk) -> None:
    ana = Principal("ana", "operator", person="P1")
    await desk.face.stop("AGI", ana, Press("p1"))

    row, details = only(desk)
    assert (row.person, row.action, row.subject) == ("P1", "stop", "AGI")
    assert details == {"press_id": "p1", "socket": True}


async def test_a_release_tells_the_holds_that_were_on_screen_and_no_more(
    desk: WebDesk,
) -> None:
    body = {"holds": ["H1", "H2"], "password": "geheim"}
    async with desk.browser() as page:
        await page.post("/api/v1/robots/AGI/release", json=body)

    row, details = only(desk)
    assert row.action == "release"
    assert details == {"status": 409, "holds": ["H1", "H2"]}


@pytest.mark.parametrize(
    "body",
    [b'{"holds": NaN}', b'{"holds": ["' + b"x" * 16384 + b'"]}'],
)
async def test_a_body_that_cannot_be_read_leaves_a_row_without_it(
    desk: WebDesk, body: bytes
) -> None:
    async with desk.browser() as page:
        headers = {"Content-Type": "application/json"}
        await page.post("/api/v1/robots/AGI/release", content=body, headers=headers)

    _, details = only(desk)
    assert details == {"status": details["status"]}


async def test_a_file_that_is_sent_is_an_export_and_reading_leaves_no_row(
    desk: WebDesk,
) -> None:
    def send(_: Request) -> Response:
        return Response("at\n", media_type="text/csv")

    desk.app.router.routes.append(Route("/api/v1/detections", send))
    async with desk.browser() as page, desk.stranger() as stranger:
        await page.get("/api/v1/robots")
        await stranger.post("/api/v1/robots/AGI/stop")
        answer = await page.get("/api/v1/detections?format=csv&robot=AGI")

    row, details = only(desk)
    assert answer.status_code == 200
    assert (row.action, row.subject) == ("export", "/api/v1/detections")
    assert details == {"query": "format=csv&robot=AGI"}


def test_sign_ins_and_refusals_are_written_with_their_address(desk: WebDesk) -> None:
    request = _request("10.0.0.7")
    with pytest.raises(HTTPException):
        desk.authenticator.sign_in(request, "wrong")
    desk.authenticator.sign_in(request, LINK)

    told = [(row.action, row.name, row.details) for row in audited(desk)]
    assert told == [
        ("sign_in_refused", "", '{"address":"10.0.0.7"}'),
        ("sign_in", "operator", '{"address":"10.0.0.7"}'),
    ]


def test_a_flood_of_wrong_sign_ins_from_everywhere_writes_few_rows(
    desk: WebDesk,
) -> None:
    for number in range(500):
        address = f"10.0.{number // 250}.{number % 250}"
        with pytest.raises(HTTPException):
            desk.authenticator.sign_in(_request(address), "x")

    assert len(audited(desk)) == 5


def _request(address: str) -> Request:
    own = [(b"x-iveg", b"1"), (b"sec-fetch-site", b"same-origin")]
    scope = {"type": "http", "method": "POST", "path": "/signin", "scheme": "http"}
    return Request({**scope, "headers": own, "client": (address, 1)})
