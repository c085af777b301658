"""Tokens over HTTP: an admin lets programs in and out; nobody else does."""

import pytest

from iveg.domain.accounts import digest_of
from iveg.web.api import account
from tests.unit.web.security.test_programs import ProgramsDesk

TOKENS = "/api/v1/tokens"


class AdminsDesk(ProgramsDesk):
    """At which admins see to the tokens."""

    def __init__(self) -> None:
        super().__init__()
        self.app.include_router(account.tokens_router(self.people))

    async def names(self) -> list[str]:
        async with self.browser("admin") as chief:
            listed = await chief.get(TOKENS)
        return [one["name"] for one in listed.json()["items"]]


@pytest.fixture
def desk() -> AdminsDesk:
    return AdminsDesk()


async def test_a_token_is_shown_once_works_and_ends_by_itself(desk: AdminsDesk) -> None:
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


async def test_who_is_revoked_is_out_before_the_answer(desk: AdminsDesk) -> None:
    who = desk.people.program("stop")
    assert who is not None
    async with desk.browser("admin") as chief, desk.caller("stop") as program:
        gone = await chief.delete(f"{TOKENS}/stop")
        stopped = await program.post("/api/v1/robots/AGI/stop")
        again = await chief.delete(f"{TOKENS}/stop")

    assert [one.status_code for one in (gone, stopped, again)] == [204, 401, 404]
    assert desk.authenticator.current(who) is None
    assert desk.book.changes == [("token_revoked", "mes-stop", "ana")]
    assert await desk.names() == ["mes-operate", "mes-read"]


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({"name": "MES-read"}, 409),
        ({"name": "a<b"}, 422),
        ({"scope": "admin"}, 422),
        ({"days": 0}, 422),
    ],
)
async def test_what_cannot_be_a_token_is_refused(
    desk: AdminsDesk, body: dict[str, object], status: int
) -> None:
    before = await desk.names()
    async with desk.browser("admin") as chief:
        refused = await chief.post(TOKENS, json={"name": "X", "scope": "read"} | body)

    assert refused.status_code == status
    assert await desk.names() == before
