"""People with accounts and programs with tokens: who gets in, and until when."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import httpx
import pytest

from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import Account, ApiToken, TokenScope, digest_of
from iveg.domain.records import AuditRecord
from iveg.web.pages.routes import router
from tests.unit.web.desk import API_TOKEN, HOST, WebDesk

T = TypeVar("T")
OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
ANA = Account("P1", "Ana Núñez", "operator", password="#acelga-1234")
CHIEF = Account("P9", "Chief", "admin", password="#acelga-1234")
EVA = Account("P2", "Eva", "viewer", invitation=digest_of("invited"))
SCOPES: tuple[TokenScope, ...] = ("read", "stop", "operate")
TOKENS = [
    ApiToken(scope, f"mes-{scope}", scope, digest_of(scope), 0) for scope in SCOPES
]


class PeoplesDesk(WebDesk):
    """A desk at which two people have accounts, and three programs tokens."""

    def __init__(self) -> None:
        super().__init__()
        eva = replace(EVA, invited_until=self.clock().wall + 60.0)
        self.book.accounts.update({"P1": ANA, "P2": eva})
        self.book.tokens.update({token.digest: token for token in TOKENS})
        self.app.include_router(router(self.pages, rule=lambda: self.rules.current))

    def page(self) -> httpx.AsyncClient:
        return self._client(OWN)

    def caller(self, token: str) -> httpx.AsyncClient:
        return self._client({"Authorization": f"Bearer {token}"})


@pytest.fixture
def desk() -> PeoplesDesk:
    return PeoplesDesk()


async def enter(page: httpx.AsyncClient, **proof: str) -> int:
    return (await page.post("/signin", json=proof)).status_code


@pytest.mark.parametrize("name", ["Ana Núñez", "ana núñez", " ANA NÚÑEZ"])
async def test_name_and_password_sign_in_whatever_the_capitals(
    desk: PeoplesDesk, name: str
) -> None:
    async with desk.page() as page:
        status = await enter(page, name=name, password="acelga-1234")
        stopped = await page.post("/api/v1/robots/AGI/stop")
        who = desk.authenticator.sessions.find(page.cookies["iveg"])

    assert (status, stopped.status_code) == (204, 202)
    assert who is not None
    assert (who.person, who.name, who.role) == ("P1", "Ana Núñez", "operator")
    (command,) = desk.commander.commands.values()
    assert command.requesters == ("Ana Núñez",)


class HeldPasswords(Passwords):
    """Real ones; ``computed`` says what, on which thread.  ``gate`` holds it up."""

    def __init__(self) -> None:
        super().__init__()
        self.computed: list[tuple[str, str]] = []
        self.gate = threading.Event()
        self.gate.set()

    async def _run(self, work: Callable[..., T], *texts: str) -> T:
        return await super()._run(partial(self._held, work), *texts)

    def _held(self, work: Callable[..., T], *texts: str) -> T:
        self.computed.append((work.__name__, threading.current_thread().name))
        assert self.gate.wait(30)
        return work(*texts)


@pytest.fixture
async def held() -> AsyncIterator[tuple[PeoplesDesk, HeldPasswords]]:
    passwords = HeldPasswords()
    desk = PeoplesDesk()
    desk.people._passwords = passwords
    yield desk, passwords
    desk.people.close()


@pytest.mark.parametrize("name", ["Ana Núñez", "Eva", "Out", "nobody", "", "x" * 64])
async def test_whoever_is_not_let_in_is_computed_as_often_and_by_the_same_path(
    held: tuple[PeoplesDesk, HeldPasswords], name: str
) -> None:
    desk, passwords = held
    desk.book.accounts["P1"] = replace(ANA, password=await passwords.hashed("right-1"))
    desk.book.accounts["P3"] = Account("P3", "Out", "viewer", disabled=True)
    passwords.computed.clear()

    wrong = {"name": name, "password": "wrong-1"}
    async with desk.page() as page:
        answer = await page.post("/signin", json=wrong)
        known = await page.post("/signin", json=wrong | {"name": ANA.name})

    assert answer.status_code == 401
    assert answer.text == known.text
    assert [work for work, _ in passwords.computed] == ["_fits", "_fits"]


async def test_a_flood_of_sign_ins_waits_in_a_short_line_beside_the_loop(
    held: tuple[PeoplesDesk, HeldPasswords],
) -> None:
    desk, passwords = held
    passwords.gate.clear()

    async def flood(number: int) -> int:
        address = f"10.0.{number // 250}.{number % 250}"
        transport = httpx.ASGITransport(desk.app, client=(address, 1))
        async with httpx.AsyncClient(
            transport=transport, base_url=f"http://{HOST}", headers=OWN
        ) as page:
            return await enter(page, name="Eva", password="wrong-password")

    guesses = [asyncio.create_task(flood(number)) for number in range(300)]
    async with asyncio.timeout(30):
        await asyncio.wait(guesses[16:])
    async with desk.browser("viewer") as page:
        stop = await page.post("/api/v1/robots/AGI/stop")
    computed_until_then = len(passwords.computed)
    passwords.gate.set()

    assert stop.status_code == 202
    assert [robot for robot, _ in desk.fleet.stops] == ["AGI"]
    # One is at work, fifteen wait; the others were refused before any computing.
    assert computed_until_then == 1
    assert sorted(await asyncio.gather(*guesses)) == [401] * 16 + [429] * 284
    assert {thread for _, thread in passwords.computed} == {"passwords_0"}


async def test_sign_ins_beyond_twenty_a_second_are_looked_at_by_nobody(
    desk: PeoplesDesk,
) -> None:
    async with desk.page() as page:
        junk = [await page.post("/signin", content=b"{") for _ in range(22)]
        stop = await page.post("/api/v1/robots/AGI/stop")
        desk.clock.now += 1.0
        later = await enter(page, name=ANA.name, password="acelga-1234")

    assert [one.status_code for one in junk] == [422] * 20 + [429] * 2
    assert junk[-1].headers["Retry-After"] == "2"
    # A stranger's STOP is refused for who they are, and not for how many there are.
    assert stop.status_code == 401
    assert later == 204


async def test_five_wrong_passwords_are_enough_for_a_minute_and_cost_no_more(
    desk: PeoplesDesk,
) -> None:
    async with desk.page() as page:
        wrong = [await enter(page, name="Eva", password="x" * 10) for _ in range(7)]
        desk.clock.now += 61.0
        right = await enter(page, name=ANA.name, password="acelga-1234")

    assert wrong == [401] * 5 + [429] * 2
    assert right == 204
    assert len(desk.passwords.asked) == 6


@pytest.mark.parametrize(
    ("after", "status"),
    [
        (ANA, 202),
        (replace(ANA, disabled=True), 401),
        (replace(ANA, since=9e9), 401),
        (replace(ANA, ends_at=1.0), 401),
        # The line of the account was damaged: nobody deletes one.
        (None, 202),
    ],
)
async def test_who_is_disabled_reset_or_over_is_out_with_stop_and_all(
    desk: PeoplesDesk, after: Account | None, status: int
) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        token = page.cookies["iveg"]
        del desk.book.accounts["P1"]
        if after is not None:
            desk.book.accounts["P1"] = after
        current = desk.authenticator.sessions.find(token)
        stopped = await page.post("/api/v1/robots/AGI/stop")

    assert stopped.status_code == status
    # `/live` asks this twice a second and closes.
    assert (current is None) == (status == 401)


@pytest.mark.parametrize(
    "proof", [{"name": ANA.name, "password": "acelga-1234"}, {"token": "cd" * 32}]
)
async def test_signing_in_anew_ends_the_session_before(
    desk: PeoplesDesk, proof: dict[str, str]
) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        before = page.cookies["iveg"]
        assert await enter(page, **proof) == 204

    assert desk.authenticator.sessions.find(before) is None


@pytest.mark.parametrize(
    ("token", "statuses"),
    [
        ("read", [200, 403, 403]),
        ("stop", [200, 202, 403]),
        ("operate", [200, 202, 200]),
        (API_TOKEN, [200, 202, 403]),
        ("other", [401, 401, 401]),
        ("", [401, 401, 401]),
    ],
)
async def test_a_scope_allows_what_it_says_and_no_more(
    desk: PeoplesDesk, token: str, statuses: list[int]
) -> None:
    async with desk.caller(token) as program:
        told = [
            (await program.get("/api/v1/robots")).status_code,
            (await program.post("/api/v1/robots/AGI/stop")).status_code,
            (
                await program.put("/api/v1/rule", json={"version": 1, "radius_m": 2.5})
            ).status_code,
        ]

    assert told == statuses


async def test_a_program_acts_by_its_own_name(desk: PeoplesDesk) -> None:
    async with desk.caller("stop") as program:
        await program.post("/api/v1/robots/AGI/stop")

    (command,) = desk.commander.commands.values()
    (row,) = desk.records(AuditRecord)
    assert command.requesters == ("mes-stop",)
    assert (row.person, row.name, row.method) == ("stop", "mes-stop", "token")
