"""One's own account over HTTP: what is known of it, and a new password."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace

import httpx
import pytest

from iveg.domain.records import AuditRecord
from iveg.web.api import account
from tests.unit.web.security.test_people import ANA, PeoplesDesk, enter

CHANGE = {"old": "acelga-1234", "new": "berenjena-77"}


class OwnDesk(PeoplesDesk):
    """At which people see to their own accounts."""

    def __init__(self) -> None:
        super().__init__()
        self.app.include_router(account.router(self.people))
        # The audit asks the authenticator of the face.
        self.face.authenticator.sessions = self.authenticator.sessions

    @asynccontextmanager
    async def ana(self) -> AsyncIterator[httpx.AsyncClient]:
        """A browser in which she has signed in."""
        async with self.page() as page:
            assert await enter(page, name=ANA.name, password="acelga-1234") == 204
            yield page


@pytest.fixture
async def desk() -> AsyncIterator[OwnDesk]:
    desk = OwnDesk()
    await desk.people.refresh()
    yield desk
    desk.people.close()


async def change(page: httpx.AsyncClient, **body: str) -> httpx.Response:
    return await page.put("/api/v1/account/password", json=CHANGE | body)


async def test_everybody_is_told_who_they_are(desk: OwnDesk) -> None:
    desk.accounts.known["P1"] = replace(ANA, ends_at=2e9)
    await desk.people.refresh()
    async with desk.ana() as ana, desk.browser() as page:
        told = [(await one.get("/api/v1/account")).json() for one in (ana, page)]

    assert [(one["name"], one["role"], one["account"]) for one in told] == [
        ("Ana Núñez", "operator", True),
        ("ana", "operator", False),
    ]
    assert [one["ends_at"] is None for one in told] == [False, True]
    assert [one["signed_in_at"] is None for one in told] == [False, False]


async def test_a_new_password_ends_the_other_sessions_and_this_one_begins_anew(
    desk: OwnDesk,
) -> None:
    async with desk.ana() as here, desk.ana() as there:
        before = here.cookies["iveg"]
        desk.clock.now += 1.0
        done = await change(here)
        elsewhere = await there.post("/api/v1/robots/AGI/stop")
        stopped = await here.post("/api/v1/robots/AGI/stop")
        old = await enter(there, name=ANA.name, password="acelga-1234")
        new = await enter(there, name=ANA.name, password="berenjena-77")

    assert (done.status_code, elsewhere.status_code, stopped.status_code) == (
        204,
        401,
        202,
    )
    assert desk.authenticator.sessions.find(before) is None
    assert (old, new) == (401, 204)
    assert ("password_changed", ANA.name, ANA.name) in desk.accounts.changes


async def test_wrong_old_passwords_count_as_sign_ins_that_were_refused(
    desk: OwnDesk,
) -> None:
    async with desk.ana() as page, desk.page() as other:
        wrong = [await change(page, old="x") for _ in range(5)]
        late = await change(page)
        sign_in = await enter(other, name=ANA.name, password="acelga-1234")
        stopped = await page.post("/api/v1/robots/AGI/stop")

    assert [one.status_code for one in wrong] == [403] * 5
    assert (late.status_code, sign_in, stopped.status_code) == (429, 429, 202)
    assert "link" not in late.json()["detail"]
    assert desk.accounts.known["P1"] == ANA
    refused = [
        one for one in desk.records(AuditRecord) if one.action == "password_changed"
    ]
    assert {one.name for one in refused} == {ANA.name}
    assert "acelga" not in "".join(one.details for one in refused)


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({"new": "short"}, 422),
        ({"new": "x" * 257}, 422),
        ({"old": "x" * 257}, 422),
        ({"name": "Eva"}, 422),
    ],
)
async def test_what_cannot_be_a_password_changes_nothing(
    desk: OwnDesk, body: dict[str, str], status: int
) -> None:
    async with desk.ana() as page:
        refused = await change(page, **body)

    assert refused.status_code == status
    assert desk.accounts.known["P1"] == ANA


async def test_a_reset_meanwhile_is_not_undone_by_the_old_password(
    desk: OwnDesk,
) -> None:
    async with desk.ana() as page:
        # An admin was faster, and the server has not read it yet.
        reset = replace(ANA, password="")
        desk.accounts.known["P1"] = reset
        refused = await change(page)

    assert refused.status_code == 403
    assert desk.accounts.known["P1"] == reset


async def test_with_the_database_away_the_password_stays(desk: OwnDesk) -> None:
    async with desk.ana() as page:
        desk.accounts.is_away = True
        refused = await change(page)
        read = await page.get("/api/v1/account")

    assert (refused.status_code, read.status_code) == (503, 200)
    assert desk.accounts.known["P1"] == ANA


async def test_who_came_by_the_link_has_no_password(desk: OwnDesk) -> None:
    async with desk.browser() as page:
        refused = await change(page)

    assert refused.status_code == 403


async def test_a_language_is_kept_with_the_account_and_given_to_the_next_browser(
    desk: OwnDesk,
) -> None:
    english = {"language": "en"}
    async with desk.ana() as here:
        before = here.cookies.get("iveg_language")
        chosen = await here.put("/api/v1/account/language", json=english)
    async with desk.ana() as there:
        page = await there.get("/account")

    assert (before, chosen.status_code) == (None, 204)
    assert there.cookies["iveg_language"] == "en"
    assert '<html lang="en"' in page.text


@pytest.mark.parametrize(
    ("language", "status"), [("fr", 422), ("", 422), (None, 422), ("en", 503)]
)
async def test_a_language_that_cannot_be_kept_is_refused(
    desk: OwnDesk, language: str | None, status: int
) -> None:
    async with desk.ana() as page:
        desk.accounts.is_away = True
        body = {"language": language}
        refused = await page.put("/api/v1/account/language", json=body)

    assert refused.status_code == status
    assert "set-cookie" not in refused.headers


async def test_a_link_keeps_its_language_in_the_browser(desk: OwnDesk) -> None:
    async with desk.browser() as page:
        body = {"language": "en"}
        refused = await page.put("/api/v1/account/language", json=body)

    assert refused.status_code == 409
