"""Passkeys: registered by their person, one answer a challenge, and nobody else's."""

import copy
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from typing import Any

import httpx
import pytest

from iveg.adapters.extras import EXTRAS
from iveg.domain.records import AuditRecord
from iveg.web.api import passkeys
from tests.fakes.authenticator import PRESENT, FakeAuthenticator, b64, unb64
from tests.unit.web.security.test_people import ANA, OWN, PeoplesDesk

OPTIONS, KEYS = "/api/v1/account/passkeys/options", "/api/v1/account/passkeys"
ORIGIN = "http://iveg.test"
Answer = dict[str, Any]
Spoiled = Callable[[Answer], object]


class PasskeysDesk(PeoplesDesk):
    """Beside them Ana has a security key in her hand."""

    def __init__(self) -> None:
        super().__init__()
        self.app.include_router(passkeys.router(self.people, self.passkeys))
        self.key = FakeAuthenticator(ORIGIN)

    def ana(self) -> httpx.AsyncClient:
        sessions = self.authenticator.sessions
        token = sessions.open(ANA.name, "operator", "P1", "password")
        return self._client({**OWN, "Cookie": f"iveg={token}"})

    async def registered(self, name: str = "llave") -> httpx.Response:
        async with self.ana() as ana:
            asked = (await ana.get(OPTIONS)).json()
            body = {"name": name, "passkey": self.key.register(asked)}
            return await ana.post(KEYS, json=body)

    async def asked(self) -> Answer:
        async with self.page() as page:
            options: Answer = (await page.get("/signin/passkey")).json()
            return options

    async def enter(self, answer: Answer, host: str = "iveg.test") -> int:
        async with self.page() as page:
            page.headers["Host"] = host
            body = {"passkey": answer}
            return (await page.post("/signin", json=body)).status_code


@pytest.fixture
async def desk() -> AsyncIterator[PasskeysDesk]:
    desk = PasskeysDesk()
    await desk.people.refresh()
    yield desk
    desk.close()


async def test_a_registered_passkey_signs_its_person_in_without_a_name(
    desk: PasskeysDesk,
) -> None:
    made = await desk.registered()
    answer = desk.key.prove(await desk.asked())
    async with desk.page() as page:
        entered = await page.post("/signin", json={"passkey": answer})
        who = desk.authenticator.sessions.find(page.cookies["iveg"])
        listed = (await page.get(KEYS)).json()["items"]

    assert (made.status_code, entered.status_code) == (201, 204)
    assert who is not None
    assert (who.person, who.name, who.role, who.method) == (
        "P1",
        "Ana Núñez",
        "operator",
        "passkey",
    )
    assert [(one["name"], one["host"]) for one in listed] == [("llave", "iveg.test")]
    assert listed[0]["used_at"] is not None
    assert desk.stored_passkeys.changes == [("passkey_added", "llave", "Ana Núñez")]
    assert [one.method for one in desk.records(AuditRecord)] == ["passkey"]


async def test_user_verification_is_asked_for_and_the_device_keeps_the_key(
    desk: PasskeysDesk,
) -> None:
    async with desk.ana() as ana:
        begun = (await ana.get(OPTIONS)).json()
    asked = await desk.asked()

    chosen = begun["authenticatorSelection"]
    assert (chosen["residentKey"], chosen["userVerification"]) == (
        "required",
        "required",
    )
    assert asked["userVerification"] == "required"
    assert asked["allowCredentials"] == []


def _shorter(name: str) -> Spoiled:
    def spoil(answer: Answer) -> None:
        answer["response"][name] = b64(unb64(answer["response"][name])[:-1])

    return spoil


SPOILED: dict[str, Spoiled] = {
    "nothing": lambda answer: answer.clear(),
    "no response": lambda answer: answer.pop("response"),
    "no text": lambda answer: answer.update(id=7),
    "two ids": lambda answer: answer.update(rawId="eA"),
    "another kind": lambda answer: answer.update(type="password"),
    "short client data": _shorter("clientDataJSON"),
    "not base64": lambda answer: answer["response"].update(clientDataJSON="á!"),
}


@pytest.mark.parametrize(
    "spoil",
    [
        *SPOILED.values(),
        lambda answer: answer.update(id="eA", rawId="eA"),
        _shorter("authenticatorData"),
        _shorter("signature"),
        lambda answer: answer["response"].update(userHandle=b64(b"P2")),
        lambda answer: answer["response"].update(userHandle=b64(b"\xff")),
    ],
)
async def test_what_is_no_answer_signs_nobody_in_and_counts(
    desk: PasskeysDesk, spoil: Spoiled
) -> None:
    await desk.registered()
    answer = desk.key.prove(await desk.asked())
    wrong = copy.deepcopy(answer)
    spoil(wrong)

    statuses = [await desk.enter(wrong) for _ in range(6)]

    assert statuses == [401] * 5 + [429]


@pytest.mark.parametrize("spoil", [*SPOILED.values(), _shorter("attestationObject")])
async def test_what_is_no_new_passkey_is_not_kept_and_counts(
    desk: PasskeysDesk, spoil: Spoiled
) -> None:
    statuses = []
    async with desk.ana() as ana:
        for _ in range(6):
            answer = desk.key.register((await ana.get(OPTIONS)).json())
            spoil(answer)
            refused = await ana.post(KEYS, json={"name": "x", "passkey": answer})
            statuses.append((refused.status_code, refused.json()["type"]))

    assert statuses[:5] == [(422, "urn:iveg:passkey-refused")] * 5
    assert statuses[5][0] == 429
    assert desk.stored_passkeys.known == {}


async def test_an_answer_counts_once(desk: PasskeysDesk) -> None:
    await desk.registered()
    answer = desk.key.prove(await desk.asked())

    assert [await desk.enter(answer), await desk.enter(answer)] == [204, 401]


@pytest.mark.parametrize(("after_s", "status"), [(299.0, 204), (301.0, 401)])
async def test_a_challenge_waits_for_five_minutes(
    desk: PasskeysDesk, after_s: float, status: int
) -> None:
    await desk.registered()
    asked = await desk.asked()
    desk.clock.now += after_s

    assert await desk.enter(desk.key.prove(asked)) == status


async def test_a_challenge_for_a_new_passkey_signs_nobody_in(
    desk: PasskeysDesk,
) -> None:
    await desk.registered()
    async with desk.ana() as ana:
        asked = (await ana.get(OPTIONS)).json()

    assert await desk.enter(desk.key.prove(asked)) == 401


async def test_nobody_keeps_a_passkey_by_the_challenge_of_another(
    desk: PasskeysDesk,
) -> None:
    async with desk.ana() as ana:
        asked = (await ana.get(OPTIONS)).json()
    token = desk.authenticator.sessions.open("Bo", "operator", "P7", "password")
    desk.accounts.known["P7"] = replace(ANA, account_id="P7", name="Bo")
    await desk.people.refresh()
    body = {"name": "x", "passkey": desk.key.register(asked)}
    async with desk.page() as page:
        refused = await page.post(KEYS, json=body, headers={"Cookie": f"iveg={token}"})

    assert refused.status_code == 422


async def test_an_answer_given_at_another_place_proves_nothing(
    desk: PasskeysDesk,
) -> None:
    await desk.registered()
    relayed = FakeAuthenticator("http://evil.test")
    relayed._key, relayed.rp_id = desk.key._key, desk.key.rp_id

    foreign = await desk.enter(relayed.prove(await desk.asked()))
    # The request says that iVeg itself were there.
    elsewhere = await desk.enter(relayed.prove(await desk.asked()), "evil.test")

    assert (foreign, elsewhere) == (401, 401)


async def test_nobody_verified_is_nobody(desk: PasskeysDesk) -> None:
    await desk.registered()
    desk.key.flags = PRESENT

    assert await desk.enter(desk.key.prove(await desk.asked())) == 401


async def test_a_copy_that_lags_behind_in_its_count_is_refused(
    desk: PasskeysDesk,
) -> None:
    await desk.registered()
    first = await desk.enter(desk.key.prove(await desk.asked()))
    await desk.passkeys.refresh()
    desk.key.count = 0

    assert [first, await desk.enter(desk.key.prove(await desk.asked()))] == [204, 401]


async def test_while_the_database_is_away_a_passkey_signs_in_and_its_use_is_kept(
    desk: PasskeysDesk,
) -> None:
    await desk.registered()
    desk.stored_passkeys.is_away = True
    entered = await desk.enter(desk.key.prove(await desk.asked()))
    desk.stored_passkeys.is_away = False
    await desk.passkeys.refresh()

    (kept,) = desk.stored_passkeys.known.values()
    assert (entered, kept.sign_count) == (204, 1)


@pytest.mark.parametrize(
    "changed", [{"disabled": True}, {"password": ""}, {"ends_at": 1.0}]
)
async def test_who_may_not_come_does_not_come_by_a_passkey(
    desk: PasskeysDesk, changed: Answer
) -> None:
    await desk.registered()
    desk.accounts.known["P1"] = replace(ANA, **changed)
    await desk.people.refresh()

    assert await desk.enter(desk.key.prove(await desk.asked())) == 401


async def test_a_removed_passkey_is_refused_and_only_its_person_removes_it(
    desk: PasskeysDesk,
) -> None:
    key_id = (await desk.registered()).json()["passkey_id"]
    token = desk.authenticator.sessions.open("Bo", "operator", "P7", "password")
    desk.accounts.known["P7"] = replace(ANA, account_id="P7", name="Bo")
    await desk.people.refresh()
    async with desk.ana() as ana, desk.page() as other:
        other.headers["Cookie"] = f"iveg={token}"
        foreign = await other.delete(f"{KEYS}/{key_id}")
        own = await ana.delete(f"{KEYS}/{key_id}")

    assert (foreign.status_code, own.status_code) == (404, 204)
    assert await desk.enter(desk.key.prove(await desk.asked())) == 401


async def test_whoever_came_by_the_link_has_no_account_to_keep_one(
    desk: PasskeysDesk,
) -> None:
    token = desk.authenticator.sessions.open_by_link()
    async with desk.page() as page:
        page.headers["Cookie"] = f"iveg={token}"
        answer = await page.get(OPTIONS)

    assert answer.status_code == 404


@pytest.mark.parametrize("host", ["192.168.1.7", "[fd00::1]"])
async def test_an_address_in_numbers_is_told_so(desk: PasskeysDesk, host: str) -> None:
    async with desk.page() as page:
        answer = await page.get("/signin/passkey", headers={"Host": host})

    assert answer.status_code == 409
    assert answer.json()["type"] == "urn:iveg:passkey-address"


async def test_strangers_who_ask_without_end_push_nobody_else_out(
    desk: PasskeysDesk,
) -> None:
    await desk.registered()
    own = await desk.asked()
    for number in range(1100):
        desk.passkeys._challenges.add(number.to_bytes(2), "10.0.0.9", "sign in", 0.0)

    assert await desk.enter(desk.key.prove(own)) == 204
    assert len(desk.passkeys._challenges._waiting) == 20


async def test_without_the_library_passkeys_are_501_and_prove_nothing(
    desk: PasskeysDesk, monkeypatch: pytest.MonkeyPatch
) -> None:
    await desk.registered()
    answer = desk.key.prove(await desk.asked())
    monkeypatch.setitem(EXTRAS, "passkeys", "no_such_library")
    async with desk.ana() as ana:
        begun = [await ana.get(OPTIONS), await ana.get("/signin/passkey")]

    assert [one.status_code for one in begun] == [501, 501]
    assert "iveg[passkeys]" in begun[0].json()["detail"]
    assert await desk.enter(answer) == 401
