"""Who is signed in where, over HTTP: seen and ended, by admins and by each person."""

import hashlib
from typing import Any

import httpx
import pytest

from iveg.domain.records import AuditRecord
from iveg.web.api import account
from iveg.web.security.sessions import IDLE_S
from tests.unit.web.api.test_account import OwnDesk

ALL, OWN = "/api/v1/sessions", "/api/v1/account/sessions"


class SessionsDesk(OwnDesk):
    """At which people see who is signed in."""

    def __init__(self) -> None:
        super().__init__()
        self.app.include_router(account.sessions_router())


@pytest.fixture
def desk() -> SessionsDesk:
    return SessionsDesk()


async def listed(page: httpx.AsyncClient, path: str) -> list[dict[str, Any]]:
    return list((await page.get(path)).json()["items"])


async def stop(page: httpx.AsyncClient) -> int:
    return (await page.post("/api/v1/robots/AGI/stop")).status_code


async def test_an_admin_sees_everybody_and_nobody_a_token_or_digest(
    desk: SessionsDesk,
) -> None:
    async with desk.browser("admin") as chief, desk.ana() as ana, desk.page() as page:
        await page.post("/signin", json={"token": "cd" * 32})
        await page.post("/wall")
        answer = await chief.get(ALL)
        own = await listed(ana, OWN)
        token = ana.cookies["iveg"]

    told = {one["name"]: one for one in answer.json()["items"]}
    assert {name: (one["role"], one["kind"]) for name, one in told.items()} == {
        "ana": ("admin", "link"),
        "Ana Núñez": ("operator", "account"),
        "operator": ("viewer", "wall"),
    }
    assert [one["name"] for one in told.values() if one["own"]] == ["ana"]
    assert [(one["name"], one["own"]) for one in own] == [("Ana Núñez", True)]
    assert token not in answer.text
    assert hashlib.sha256(token.encode()).hexdigest() not in answer.text
    assert desk.authenticator.sessions.find(own[0]["session_id"]) is None


async def test_an_ended_session_is_out_before_the_answer_with_its_socket(
    desk: SessionsDesk,
) -> None:
    async with desk.browser("admin") as chief, desk.ana() as ana:
        who = desk.authenticator.sessions.find(ana.cookies["iveg"])
        assert who is not None
        (ends,) = (one for one in await listed(chief, ALL) if not one["own"])
        ended = await chief.delete(f"{ALL}/{ends['session_id']}")
        stopped = await stop(ana)
        again = await chief.delete(f"{ALL}/{ends['session_id']}")

    assert (ended.status_code, stopped, again.status_code) == (200, 401, 404)
    # `/live` asks this twice a second and closes.
    assert desk.authenticator.sessions.current(who) is None
    rows = [one for one in desk.records(AuditRecord) if one.action == "session_ended"]
    assert [(one.name, one.subject) for one in rows] == [
        ("ana", ends["session_id"])
    ] * 2
    assert '"name":"Ana Núñez"' in rows[0].details.encode().decode("unicode_escape")


async def test_all_others_end_and_whoever_asks_stays(desk: SessionsDesk) -> None:
    async with desk.browser("admin") as chief, desk.ana() as ana, desk.ana() as too:
        ended = await chief.delete(ALL)
        stops = [await stop(one) for one in (chief, ana, too)]

    assert ended.json() == {"ended": 2}
    assert stops == [202, 401, 401]


async def test_people_end_their_own_elsewhere_and_nobody_elses(
    desk: SessionsDesk,
) -> None:
    async with desk.ana() as here, desk.ana() as there, desk.browser("admin") as chief:
        (others,) = (one for one in await listed(chief, ALL) if one["own"])
        foreign = await here.delete(f"{OWN}/{others['session_id']}")
        asked = [await here.delete(ALL), await here.get(ALL)]
        ended = await here.delete(OWN)
        stops = [await stop(one) for one in (here, there, chief)]

    assert foreign.status_code == 404
    assert [one.status_code for one in asked] == [403, 403]
    assert ended.json() == {"ended": 1}
    assert stops == [202, 401, 202]


async def test_a_wall_ends_no_session(
    desk: SessionsDesk,
) -> None:
    async with desk.ana() as wall, desk.ana() as ana:
        await wall.post("/wall")
        (mine,) = (one for one in await listed(wall, OWN) if one["own"])
        refused = [
            await wall.delete(OWN),
            await wall.delete(f"{OWN}/{mine['session_id']}"),
        ]
        stops = [await stop(one) for one in (wall, ana)]

    assert mine["kind"] == "wall"
    assert [one.status_code for one in refused] == [403] * 2
    assert stops == [202, 202]


async def test_a_page_that_an_expired_session_opens_says_so_and_keeps_its_stops(
    desk: SessionsDesk,
) -> None:
    async with desk.ana() as page:
        desk.clock.now += IDLE_S + 60.0
        shown = await page.get("/", headers={"Accept": "text/html"})
        left = await page.post("/signout")

    assert (shown.status_code, left.status_code) == (403, 303)
    assert 'data-role="expired"' in shown.text
    assert 'data-stop="fleet"' in shown.text
