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

    @asynccontextmanager
    async def ana(self) -> AsyncIterator[httpx.AsyncClient]:
        """A browser in which she has signed in."""
        async with self.page() as page:
            assert await enter(page, name=ANA.name, password="acelga-1234") == 204
            yield page


@pytest.fixture
def desk() -> OwnDesk:
    return OwnDesk()


async def change(page: httpx.AsyncClient, **body: str) -> httpx.Response:
    return await page.put("/api/v1/account/password", json=CHANGE | body)


async def test_everybody_is_told_who_they_are(desk: OwnDesk) -> None:
    desk.book.accounts["P1"] = replace(ANA, ends_at=2e9)
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
    assert ("password_changed", ANA.name, ANA.name) in desk.book.changes


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
    assert desk.book.accounts["P1"] == ANA
    refused = [
        one for one in desk.records(AuditRecord) if one.action == "password_changed"
    ]
    assert {one.name for one in refused} == {ANA.name}
    assert "acelga" not in "".join(one.details for one in refused)


async def test_a_reset_meanwhile_is_not_undone_by_the_old_password(
    desk: OwnDesk,
) -> None:
    async with desk.ana() as page:
        reset = replace(ANA, password="")
        desk.book.accounts["P1"] = reset
        refused = await change(page)

    assert refused.status_code == 403
    assert desk.book.accounts["P1"] == reset
