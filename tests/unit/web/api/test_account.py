"""Accounts, sessions and tokens over HTTP: one's own, and everybody's for admins."""

import hashlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import httpx
import pytest

from iveg.cli.running import reachable_host
from iveg.domain.accounts import digest_of
from iveg.domain.records import AuditRecord
from iveg.web.api import account
from tests.unit.web.security.test_people import ANA, CHIEF, OWN, PeoplesDesk, enter

CHANGE = {"old": "acelga-1234", "new": "berenjena-77"}
SESSIONS, OWN_SESSIONS = "/api/v1/sessions", "/api/v1/account/sessions"
TOKENS = "/api/v1/tokens"


class AccessDesk(PeoplesDesk):
    """At which people see to their own accounts, and an admin to everybody's."""

    def __init__(self) -> None:
        super().__init__()
        self.book.accounts["P9"] = CHIEF
        for router in (
            account.router(self.people),
            account.sessions_router(),
            account.users_router(self.people),
            account.tokens_router(self.people),
        ):
            self.app.include_router(router)

    @asynccontextmanager
    async def ana(self) -> AsyncIterator[httpx.AsyncClient]:
        """A browser in which she has signed in."""
        async with self.page() as page:
            assert await enter(page, name=ANA.name, password="acelga-1234") == 204
            yield page

    async def programs(self) -> list[str]:
        async with self.browser("admin") as chief:
            listed = await chief.get(TOKENS)
        return [program["name"] for program in listed.json()["items"]]

    def admin(self) -> httpx.AsyncClient:
        token = self.authenticator.sessions.open("Chief", "admin", "P9", "password")
        return self._client({**OWN, "Cookie": f"iveg={token}"})


@pytest.fixture
def desk() -> AccessDesk:
    return AccessDesk()


async def stop(page: httpx.AsyncClient) -> int:
    return (await page.post("/api/v1/robots/AGI/stop")).status_code


# --- one's own account --------------------------------------------------------------


async def change(page: httpx.AsyncClient, **body: str) -> httpx.Response:
    return await page.put("/api/v1/account/password", json=CHANGE | body)


async def test_a_new_password_ends_the_other_sessions_and_this_one_begins_anew(
    desk: AccessDesk,
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
    desk: AccessDesk,
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
    desk: AccessDesk,
) -> None:
    async with desk.ana() as page:
        reset = replace(ANA, password="")
        desk.book.accounts["P1"] = reset
        refused = await change(page)

    assert refused.status_code == 403
    assert desk.book.accounts["P1"] == reset


# --- everybody's accounts ------------------------------------------------------------


async def test_an_invitation_is_shown_once_works_once_and_begins_the_account(
    desk: AccessDesk,
) -> None:
    body = {"name": "Luz Gil", "role": "operator", "days": 2}
    async with desk.admin() as chief, desk.page() as page:
        made = await chief.post("/api/v1/users", json=body)
        listed = await chief.get("/api/v1/users")
        link = made.json()["code"]["link"]
        proof = {"invitation": link.partition("#invitation=")[2]}
        begun = await enter(page, **proof, password="berenjena-77")
        again = await enter(page, **proof, password="berenjena-78")
        desk.clock.now += 2 * 86_400.0 - 1.0
        before = await enter(page, name="Luz Gil", password="berenjena-77")
        desk.clock.now += 2.0
        after = await enter(page, name="Luz Gil", password="berenjena-77")

    assert (made.status_code, begun, again) == (201, 204, 401)
    assert (before, after) == (204, 401)
    assert made.json()["code"]["image"].startswith("data:image/svg+xml")
    assert made.json()["user"]["state"] == "invited"
    (kept,) = (one for one in desk.book.accounts.values() if one.name == "Luz Gil")
    assert kept.invitation == ""
    # The list tells neither an invitation nor a hash.
    assert proof["invitation"] not in listed.text
    assert digest_of(proof["invitation"]) not in listed.text
    assert "acelga" not in listed.text
    assert [one["name"] for one in listed.json()["items"]] == [
        "Ana Núñez",
        "Chief",
        "Eva",
        "Luz Gil",
    ]


@pytest.mark.parametrize(
    ("change", "body"),
    [("reset", None), ("disable", None), ("role", {"role": "viewer"})],
)
async def test_who_is_changed_is_signed_out_before_the_answer(
    desk: AccessDesk, change: str, body: dict[str, str] | None
) -> None:
    method = "PUT" if body else "POST"
    async with desk.admin() as chief, desk.page() as ana:
        await enter(ana, name=ANA.name, password="acelga-1234")
        desk.clock.now += 1.0
        done = await chief.request(method, f"/api/v1/users/P1/{change}", json=body)
        stopped = await ana.post("/api/v1/robots/AGI/stop")

    assert (done.status_code, stopped.status_code) == (200, 401)
    word = "disabled" if change == "disable" else change
    assert desk.book.changes == [(f"account_{word}", ANA.name, "Chief")]


async def test_a_reset_lets_in_again_who_was_shut_out(desk: AccessDesk) -> None:
    desk.book.accounts["P1"] = replace(ANA, disabled=True)
    async with desk.admin() as chief, desk.page() as ana:
        made = await chief.post("/api/v1/users/P1/reset")
        link = made.json()["code"]["link"].partition("#invitation=")[2]
        old = await enter(ana, name=ANA.name, password="acelga-1234")
        begun = await enter(ana, invitation=link, password="berenjena-77")

    assert (old, begun) == (401, 204)


@pytest.mark.parametrize("change", ["reset", "disable", "role"])
async def test_nobody_changes_their_own_account_so_that_an_admin_stays(
    desk: AccessDesk, change: str
) -> None:
    body = {"role": "viewer"} if change == "role" else None
    method = "PUT" if body else "POST"
    async with desk.admin() as chief:
        refused = await chief.request(method, f"/api/v1/users/P9/{change}", json=body)

    assert refused.status_code == 409
    assert desk.book.accounts["P9"] == CHIEF
    (row,) = desk.records(AuditRecord)
    assert row.subject == "P9"
    assert '"status":409' in row.details


@pytest.mark.parametrize(
    ("path", "body", "status"),
    [
        ("users", {"name": "ANA núñez", "role": "viewer"}, 409),
        ("users", {"name": "Console", "role": "viewer"}, 422),
        ("users", {"name": "Luz", "role": "program"}, 422),
        ("tokens", {"name": "MES-read", "scope": "read"}, 409),
        ("tokens", {"name": "X", "scope": "admin"}, 422),
    ],
)
async def test_what_cannot_be_an_account_or_a_token_is_refused(
    desk: AccessDesk, path: str, body: dict[str, object], status: int
) -> None:
    before = dict(desk.book.accounts), dict(desk.book.tokens)
    async with desk.admin() as chief:
        refused = await chief.post(f"/api/v1/{path}", json=body)

    assert refused.status_code == status
    assert (desk.book.accounts, desk.book.tokens) == before


# --- sessions -----------------------------------------------------------------------


async def listed(page: httpx.AsyncClient, path: str) -> list[dict[str, Any]]:
    return list((await page.get(path)).json()["items"])


async def test_an_admin_sees_everybody_and_nobody_a_token_or_digest(
    desk: AccessDesk,
) -> None:
    async with desk.browser("admin") as chief, desk.ana() as ana, desk.page() as page:
        await page.post("/signin", json={"token": "cd" * 32})
        answer = await chief.get(SESSIONS)
        own = await listed(ana, OWN_SESSIONS)
        token = ana.cookies["iveg"]

    told = {one["name"]: one for one in answer.json()["items"]}
    assert {name: (one["role"], one["kind"]) for name, one in told.items()} == {
        "ana": ("admin", "link"),
        "Ana Núñez": ("operator", "account"),
        "operator": ("operator", "link"),
    }
    assert [one["name"] for one in told.values() if one["own"]] == ["ana"]
    assert [(one["name"], one["own"]) for one in own] == [("Ana Núñez", True)]
    assert token not in answer.text
    assert hashlib.sha256(token.encode()).hexdigest() not in answer.text
    assert desk.authenticator.sessions.find(own[0]["session_id"]) is None


async def test_an_ended_session_is_out_before_the_answer_with_its_socket(
    desk: AccessDesk,
) -> None:
    async with desk.browser("admin") as chief, desk.ana() as ana:
        token = ana.cookies["iveg"]
        (ends,) = (one for one in await listed(chief, SESSIONS) if not one["own"])
        ended = await chief.delete(f"{SESSIONS}/{ends['session_id']}")
        stopped = await stop(ana)
        again = await chief.delete(f"{SESSIONS}/{ends['session_id']}")

    assert (ended.status_code, stopped, again.status_code) == (200, 401, 404)
    # `/live` asks this twice a second and closes.
    assert desk.authenticator.sessions.find(token) is None
    rows = [one for one in desk.records(AuditRecord) if one.action == "session_ended"]
    assert [(one.name, one.subject) for one in rows] == [
        ("ana", ends["session_id"])
    ] * 2
    assert '"name":"Ana Núñez"' in rows[0].details.encode().decode("unicode_escape")


async def test_people_end_their_own_elsewhere_and_nobody_elses(
    desk: AccessDesk,
) -> None:
    async with desk.ana() as here, desk.ana() as there, desk.browser("admin") as chief:
        (others,) = (one for one in await listed(chief, SESSIONS) if one["own"])
        foreign = await here.delete(f"{OWN_SESSIONS}/{others['session_id']}")
        listing = await here.get(SESSIONS)
        (mine,) = (one for one in await listed(here, OWN_SESSIONS) if not one["own"])
        ended = await here.delete(f"{OWN_SESSIONS}/{mine['session_id']}")
        stops = [await stop(one) for one in (here, there, chief)]

    assert foreign.status_code == 404
    assert listing.status_code == 403
    assert ended.status_code == 200
    assert stops == [202, 401, 202]


# --- tokens -------------------------------------------------------------------------


async def test_a_token_is_shown_once_works_and_ends_by_itself(desk: AccessDesk) -> None:
    body = {"name": "Weather", "scope": "stop", "days": 1}
    async with desk.browser("admin") as chief:
        made = await chief.post(TOKENS, json=body)
        token = made.json()["token"]
        async with desk.caller(token) as program:
            before = await program.post("/api/v1/robots/AGI/stop")
        listed = await chief.get(TOKENS)
        desk.clock.now += 86_400.0
        async with desk.caller(token) as program:
            after = await program.post("/api/v1/robots/AGI/stop")
    async with desk.browser("admin") as chief:
        told = {one["name"]: one for one in (await chief.get(TOKENS)).json()["items"]}

    assert (made.status_code, before.status_code, after.status_code) == (201, 202, 401)
    assert token not in listed.text
    assert digest_of(token) not in listed.text
    # Its use is told at once, though it is written down once a minute.
    used = {one["name"]: one["used_at"] for one in listed.json()["items"]}
    assert used["Weather"] is not None
    assert used["mes-read"] is None
    assert [told[one]["over"] for one in ("Weather", "mes-read")] == [True, False]
    assert desk.book.changes == [("token_added", "Weather", "ana")]


async def test_who_is_revoked_is_out_before_the_answer(desk: AccessDesk) -> None:
    async with desk.browser("admin") as chief, desk.caller("stop") as program:
        gone = await chief.delete(f"{TOKENS}/stop")
        stopped = await program.post("/api/v1/robots/AGI/stop")
        again = await chief.delete(f"{TOKENS}/stop")

    assert [one.status_code for one in (gone, stopped, again)] == [204, 401, 404]
    assert desk.people.program("stop") is None
    assert desk.book.changes == [("token_revoked", "mes-stop", "ana")]
    assert await desk.programs() == ["mes-operate", "mes-read"]


@pytest.mark.parametrize("every", ["0.0.0.0", "::"])  # noqa: S104 - nobody listens
def test_a_server_at_every_address_is_named_by_one_that_leads_there(every: str) -> None:
    assert reachable_host(every) not in (every, "")
