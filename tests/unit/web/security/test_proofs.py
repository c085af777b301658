"""A release asks for a proof that is not old; STOP, link and programs are not asked."""

from collections.abc import AsyncIterator
from typing import Any

import httpx
import pytest

from iveg.domain.records import AuditRecord
from iveg.web.api import proof
from iveg.web.security.proofs import Freshness
from tests.unit.web.api.test_commands import stopped
from tests.unit.web.security.test_passkeys import PasskeysDesk
from tests.unit.web.security.test_people import ANA, OWN

RELEASE, STOP = "/api/v1/robots/AGI/release", "/api/v1/robots/AGI/stop"
PROOF = "/api/v1/account/proof"
QUARTER_S = 900.0


class ProofsDesk(PasskeysDesk):
    """A desk that asks who has not said for a quarter of an hour who they are."""

    def __init__(self) -> None:
        super().__init__()
        self.app.include_router(proof.router(self.people, self.passkeys, self.pins))
        self.ask_within(QUARTER_S)

    def ask_within(self, seconds: float) -> None:
        self.authenticator.freshness = Freshness(seconds, self.clock)

    def by_link(self) -> httpx.AsyncClient:
        token = self.authenticator.sessions.open_by_link()
        return self._client({**OWN, "Cookie": f"iveg={token}"})

    async def release(self, page: httpx.AsyncClient, hold: str = "") -> tuple[int, str]:
        hold = hold or await stopped(self)
        answer = await page.post(RELEASE, json={"holds": [hold]})
        return answer.status_code, answer.json().get("type", "")


@pytest.fixture
async def desk() -> AsyncIterator[ProofsDesk]:
    desk = ProofsDesk()
    await desk.people.refresh()
    yield desk
    desk.close()


NEEDED = (403, "urn:iveg:proof-needed")


@pytest.mark.parametrize(
    ("after_s", "said"), [(890.0, (202, "")), (QUARTER_S + 1.0, NEEDED)]
)
async def test_i2_a_release_needs_a_proof_of_the_last_quarter_of_an_hour(
    desk: ProofsDesk, after_s: float, said: tuple[int, str]
) -> None:
    async with desk.ana() as ana:
        desk.clock.now += after_s
        assert await desk.release(ana) == said


async def test_i11_stop_never_asks(desk: ProofsDesk) -> None:
    async with desk.ana() as ana:
        desk.clock.now += QUARTER_S + 1.0

        assert (await ana.post(STOP)).status_code == 202


async def test_the_link_programs_and_a_site_that_switched_it_off_are_not_asked(
    desk: ProofsDesk,
) -> None:
    async with desk.by_link() as link, desk.ana() as ana:
        desk.clock.now += QUARTER_S + 1.0
        told = [(await desk.release(link))[0], (await link.get(PROOF)).json()]
        desk.ask_within(0.0)
        off = await desk.release(ana)

    assert told == [202, {"needed": False, "until": None, "ways": []}]
    assert off == (202, "")


async def test_a_password_proves_it_and_the_release_goes_on(desk: ProofsDesk) -> None:
    async with desk.ana() as ana:
        desk.clock.now += QUARTER_S + 1.0
        before, hold = (await ana.get(PROOF)).json(), await stopped(desk)
        refused = await desk.release(ana, hold)
        given = await ana.post(PROOF, json={"password": "acelga-1234"})
        after = (await ana.get(PROOF)).json()
        released = await desk.release(ana, hold)

    assert (before["needed"], before["ways"]) == (True, ["password"])
    assert (refused, given.status_code) == (NEEDED, 204)
    assert (after["needed"], released) == (False, (202, ""))


async def test_a_proof_makes_no_session_younger(desk: ProofsDesk) -> None:
    async with desk.ana() as ana:
        for _ in range(25):
            desk.clock.now += 3600.0
            given = await ana.post(PROOF, json={"password": "acelga-1234"})
        read = await ana.get("/api/v1/robots")

    assert (given.status_code, read.status_code) == (403, 403)


async def test_a_passkey_of_the_same_person_proves_it(desk: ProofsDesk) -> None:
    await desk.registered()
    async with desk.ana() as ana:
        desk.clock.now += QUARTER_S + 1.0
        asked = (await ana.get(f"{PROOF}/options")).json()
        given = await ana.post(PROOF, json={"passkey": desk.key.prove(asked)})
        released = await desk.release(ana)

    assert [one["id"] for one in asked["allowCredentials"]]
    assert (given.status_code, released) == (204, (202, ""))


@pytest.mark.parametrize(
    "body", [{"password": "wrong-password"}, {"password": ""}, {"passkey": {"id": "x"}}]
)
async def test_a_wrong_proof_is_none_and_five_are_enough_for_a_minute(
    desk: ProofsDesk, body: dict[str, Any]
) -> None:
    async with desk.ana() as ana:
        desk.clock.now += QUARTER_S + 1.0
        wrong = [await ana.post(PROOF, json=body) for _ in range(5)]
        right = await ana.post(PROOF, json={"password": "acelga-1234"})
        refused = await desk.release(ana)
        stop = await ana.post(STOP)

    assert {one.status_code for one in wrong} == {403}
    assert {one.json()["type"] for one in wrong} == {"urn:iveg:proof-wrong"}
    assert (right.status_code, refused, stop.status_code) == (429, NEEDED, 202)


async def test_a_new_passkey_asks_for_a_fresh_proof_too(desk: ProofsDesk) -> None:
    async with desk.ana() as ana:
        desk.clock.now += QUARTER_S + 1.0
        begun = await ana.get("/api/v1/account/passkeys/options")

    assert (begun.status_code, begun.json()["type"]) == NEEDED


async def test_a_challenge_of_a_sign_in_proves_nothing_here(desk: ProofsDesk) -> None:
    await desk.registered()
    answer = desk.key.prove(await desk.asked())
    async with desk.ana() as ana:
        given = await ana.post(PROOF, json={"passkey": answer})

    assert given.status_code == 403


@pytest.mark.parametrize(
    "body",
    [{}, {"password": 7}, {"password": "x" * 257}, {"a": "", "password": "x"}],
)
async def test_what_is_no_proof_is_invalid(
    desk: ProofsDesk, body: dict[str, Any]
) -> None:
    async with desk.ana() as ana:
        assert (await ana.post(PROOF, json=body)).status_code == 422


async def test_the_audit_has_each_proof_and_no_password(desk: ProofsDesk) -> None:
    async with desk.ana() as ana:
        for password in ("wrong-password", "acelga-1234"):
            await ana.post(PROOF, json={"password": password})

    rows = [one for one in desk.records(AuditRecord) if one.action == "proof"]
    assert [(one.name, one.details) for one in rows] == [
        (ANA.name, '{"status":403}'),
        (ANA.name, '{"status":204}'),
    ]
