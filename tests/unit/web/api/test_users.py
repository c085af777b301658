"""Accounts over HTTP: an admin invites, changes and shuts out; nobody else does."""

from dataclasses import replace

import httpx
import pytest

from iveg.domain.accounts import Account, digest_of
from iveg.domain.records import AuditRecord
from iveg.web.api import account
from tests.unit.web.security.test_people import ANA, OWN, PeoplesDesk, enter

CHIEF = Account("P9", "Chief", "admin", password="#acelga-1234")


class AdminsDesk(PeoplesDesk):
    """Beside them an admin is signed in."""

    def __init__(self) -> None:
        super().__init__()
        self.book.accounts["P9"] = CHIEF
        self.app.include_router(account.users_router(self.people))

    def admin(self) -> httpx.AsyncClient:
        token = self.authenticator.sessions.open("Chief", "admin", "P9", "password")
        return self._client({**OWN, "Cookie": f"iveg={token}"})


@pytest.fixture
def desk() -> AdminsDesk:
    return AdminsDesk()


async def test_an_invitation_is_shown_once_and_begins_the_account(
    desk: AdminsDesk,
) -> None:
    body = {"name": "Luz Gil", "role": "operator", "days": 2}
    async with desk.admin() as chief, desk.page() as page:
        made = await chief.post("/api/v1/users", json=body)
        listed = await chief.get("/api/v1/users")
        link = made.json()["code"]["link"]
        proof = {"invitation": link.partition("#invitation=")[2]}
        begun = await enter(page, **proof, password="berenjena-77")
        desk.clock.now += 2 * 86_400.0 - 1.0
        before = await enter(page, name="Luz Gil", password="berenjena-77")
        desk.clock.now += 2.0
        after = await enter(page, name="Luz Gil", password="berenjena-77")

    assert (made.status_code, begun, before, after) == (201, 204, 204, 401)
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
    desk: AdminsDesk, change: str, body: dict[str, str] | None
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


async def test_a_reset_lets_in_again_who_was_shut_out(desk: AdminsDesk) -> None:
    desk.book.accounts["P1"] = replace(ANA, disabled=True)
    async with desk.admin() as chief, desk.page() as ana:
        made = await chief.post("/api/v1/users/P1/reset")
        link = made.json()["code"]["link"].partition("#invitation=")[2]
        old = await enter(ana, name=ANA.name, password="acelga-1234")
        begun = await enter(ana, invitation=link, password="berenjena-77")

    assert (old, begun) == (401, 204)


async def test_whom_the_provider_vouches_for_keeps_its_role_and_is_let_in_again(
    desk: AdminsDesk,
) -> None:
    sso = Account("sso-1", "Luz", "operator", provider="https://idm.test")
    desk.book.accounts["sso-1"] = sso
    async with desk.admin() as chief:
        role = await chief.put("/api/v1/users/sso-1/role", json={"role": "admin"})
        out = await chief.post("/api/v1/users/sso-1/disable", json={})
        again = await chief.post("/api/v1/users/sso-1/reset", json={})

    assert (role.status_code, role.json()["type"]) == (409, "urn:iveg:provided-account")
    assert out.json()["state"] == "disabled"
    # No invitation: a password would let in whom the provider does not know any more.
    assert again.json()["code"] is None
    assert again.json()["user"]["provided"]
    kept = desk.book.accounts["sso-1"]
    assert (kept.disabled, kept.invitation, kept.role) == (False, "", "operator")


@pytest.mark.parametrize("change", ["reset", "disable", "role"])
async def test_nobody_changes_their_own_account_so_that_an_admin_stays(
    desk: AdminsDesk, change: str
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
    ("body", "status"),
    [
        ({"name": "ANA núñez", "role": "viewer"}, 409),
        ({"name": "a<b", "role": "viewer"}, 422),
        ({"name": "Console", "role": "viewer"}, 422),
        ({"name": "Luz", "role": "program"}, 422),
        ({"name": "Luz", "role": "viewer", "days": 0}, 422),
        ({"name": "Luz", "role": "viewer", "password": "x"}, 422),
    ],
)
async def test_what_cannot_be_an_account_is_refused(
    desk: AdminsDesk, body: dict[str, object], status: int
) -> None:
    before = dict(desk.book.accounts)
    async with desk.admin() as chief:
        refused = await chief.post("/api/v1/users", json=body)

    assert refused.status_code == status
    assert desk.book.accounts == before
