"""People with accounts: who gets in, by what, and until when."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from functools import partial
from typing import ParamSpec, TypeVar

import httpx
import pytest

from iveg.adapters.bounded_thread import BoundedThread
from iveg.adapters.passwords import Passwords
from iveg.domain.accounts import Account, digest_of
from iveg.domain.records import AuditRecord
from iveg.web.pages.openapi import ApiDoc
from iveg.web.pages.routes import router
from iveg.web.security.authentication import Authenticator
from iveg.web.security.passkeys import Passkeys
from iveg.web.security.people import People
from iveg.web.security.tablets import Pins
from tests.fakes.accounts import FakeAccounts, FakePasskeys, FakePasswords
from tests.unit.web.desk import HOST, WebDesk

P = ParamSpec("P")
T = TypeVar("T")
OWN = {"X-IVEG": "1", "Sec-Fetch-Site": "same-origin"}
ANA = Account("P1", "Ana Núñez", "operator", password="#acelga-1234")
EVA = Account("P2", "Eva", "viewer", invitation=digest_of("invited"))


class PeoplesDesk(WebDesk):
    """A desk at which two people have accounts."""

    def __init__(self, real: Passwords | None = None) -> None:
        super().__init__()
        now = self.clock().wall
        self.accounts = FakeAccounts(ANA, replace(EVA, invited_until=now + 60.0))
        self.passwords = FakePasswords()
        self.people = People(self.accounts, real or self.passwords, self.clock)
        self.pins = Pins(self.people, self.clock)
        self.stored_passkeys = FakePasskeys()
        self.passkeys = Passkeys(self.stored_passkeys, self.clock)
        self.authenticator = Authenticator(
            sign_in_token="cd" * 32,
            api_token="",
            clock=self.clock,
            trail=self.trail,
            people=self.people,
            passkeys=self.passkeys,
        )
        # What stands before the routes asks the authenticator of the face.
        self.face.authenticator.sessions = self.authenticator.sessions
        self.app.state.authenticator = self.authenticator
        self.app.include_router(
            router(
                self.pages,
                document=lambda: ApiDoc("", "", (), ()),
                rule=lambda: self.rules.current,
            )
        )

    def close(self) -> None:
        self.people.close()
        self.passkeys.close()

    def page(self) -> httpx.AsyncClient:
        return self._client(OWN)


@pytest.fixture
async def desk() -> AsyncIterator[PeoplesDesk]:
    desk = PeoplesDesk()
    await desk.people.refresh()
    yield desk
    desk.close()


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


@pytest.mark.parametrize("name", ["Ana Núñez", "Eva", "nobody", ""])
async def test_a_wrong_name_and_a_wrong_password_are_told_alike(
    desk: PeoplesDesk, name: str
) -> None:
    async with desk.page() as page:
        wrong = {"name": name, "password": "wrong-password"}
        answer = await page.post("/signin", json=wrong)
        known = await page.post("/signin", json={"name": "Ana Núñez", "password": "x"})

    assert (answer.status_code, answer.text) == (known.status_code, known.text)
    assert answer.status_code == 401
    # Each was checked against something, so that none is faster.
    assert len(desk.passwords.asked) == 2


class HeldThread(BoundedThread):
    """A real one; ``computed`` says what, on which thread.  ``gate`` holds it up."""

    def __init__(self) -> None:
        super().__init__("passwords")
        self.computed: list[tuple[str, str]] = []
        self.gate = threading.Event()
        self.gate.set()

    async def run(self, work: Callable[P, T], *args: P.args, **named: P.kwargs) -> T:
        return await super().run(partial(self._held, work), *args, **named)

    def _held(self, work: Callable[P, T], *args: P.args, **named: P.kwargs) -> T:
        self.computed.append((work.__name__, threading.current_thread().name))
        assert self.gate.wait(30)
        return work(*args, **named)


@pytest.fixture
async def held() -> AsyncIterator[tuple[PeoplesDesk, Passwords, HeldThread]]:
    thread = HeldThread()
    passwords = Passwords(thread)
    desk = PeoplesDesk(passwords)
    await desk.people.refresh()
    yield desk, passwords, thread
    desk.people.close()


@pytest.mark.parametrize("name", ["Ana Núñez", "Eva", "Out", "nobody", "", "x" * 64])
async def test_whoever_is_not_let_in_is_computed_as_often_and_by_the_same_path(
    held: tuple[PeoplesDesk, Passwords, HeldThread], name: str
) -> None:
    desk, passwords, thread = held
    desk.accounts.known["P1"] = replace(ANA, password=await passwords.hashed("right-1"))
    desk.accounts.known["P3"] = Account("P3", "Out", "viewer", disabled=True)
    await desk.people.refresh()
    thread.computed.clear()

    async with desk.page() as page:
        statuses = [await enter(page, name=name, password="wrong-1") for _ in range(2)]

    assert statuses == [401, 401]
    # The hash that stands for nobody's is made once, whoever comes first.
    assert [work for work, _ in thread.computed] == ["_hash", "_fits", "_fits"]


async def test_a_flood_of_sign_ins_waits_in_a_short_line_beside_the_loop(
    held: tuple[PeoplesDesk, Passwords, HeldThread],
) -> None:
    desk, passwords, thread = held
    await passwords.fits("", "")
    thread.computed.clear()
    thread.gate.clear()

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
    computed_until_then = len(thread.computed)
    thread.gate.set()

    assert stop.status_code == 202
    assert [robot for robot, _ in desk.fleet.stops] == ["AGI"]
    # One is at work, fifteen wait; the others were refused before any computing.
    assert computed_until_then == 1
    assert sorted(await asyncio.gather(*guesses)) == [401] * 16 + [429] * 284
    assert {thread for _, thread in thread.computed} == {"passwords_0"}


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


async def test_an_invitation_works_once_and_chooses_the_password(
    desk: PeoplesDesk,
) -> None:
    proof = {"invitation": "invited", "password": "berenjena-77"}
    async with desk.page() as page, desk.page() as other:
        statuses = [await enter(page, **proof), await enter(other, **proof)]
        again = await enter(other, name="Eva", password="berenjena-77")

    assert statuses == [204, 401]
    assert again == 204


@pytest.mark.parametrize(
    ("proof", "said"),
    [
        ({"token": "x"}, "wrong token"),
        ({"name": "Eva", "password": "x"}, "wrong name or password"),
        ({"invitation": "x", "password": "x" * 10}, "no such invitation"),
    ],
)
async def test_the_log_says_what_was_wrong_and_not_whose(
    desk: PeoplesDesk,
    proof: dict[str, str],
    said: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with desk.page() as page:
        await enter(page, **proof)

    assert caplog.messages == [f"sign-in refused: {said} (1 so far)"]


async def test_an_invitation_that_is_over_begins_nothing(desk: PeoplesDesk) -> None:
    desk.clock.now += 61.0
    async with desk.page() as page:
        status = await enter(page, invitation="invited", password="berenjena-77")

    assert status == 401
    assert desk.accounts.known["P2"].password == ""


async def test_a_short_password_is_refused_and_the_invitation_stays(
    desk: PeoplesDesk,
) -> None:
    async with desk.page() as page:
        short = await enter(page, invitation="invited", password="short")
        long = await enter(page, invitation="invited", password="berenjena-77")

    assert (short, long) == (422, 204)


@pytest.mark.parametrize(
    ("after", "status"),
    [
        (ANA, 202),
        (replace(ANA, disabled=True), 401),
        (replace(ANA, since=9e9), 401),
        (replace(ANA, ends_at=1.0), 401),
        (None, 401),
    ],
)
async def test_who_is_disabled_reset_or_over_is_out_with_stop_and_all(
    desk: PeoplesDesk, after: Account | None, status: int
) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        who = desk.authenticator.sessions.find(page.cookies["iveg"])
        assert who is not None
        desk.accounts.known = {} if after is None else {"P1": after}
        await desk.people.refresh()
        current = desk.authenticator.sessions.current(who)
        stopped = await page.post("/api/v1/robots/AGI/stop")

    assert stopped.status_code == status
    # `/live` asks this twice a second and closes.
    assert (current is None) == (status == 401)


async def test_while_the_database_is_away_what_was_read_last_counts(
    desk: PeoplesDesk,
) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        desk.accounts.is_away = True
        running = await page.post("/api/v1/robots/AGI/stop")

    assert running.status_code == 202


async def test_before_the_first_reading_a_session_may_stop_and_no_more(
    desk: PeoplesDesk,
) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        desk.people._known = None
        read = await page.get("/api/v1/robots")
        stopped = await page.post("/api/v1/robots/AGI/stop")

    assert (read.status_code, stopped.status_code) == (403, 202)


async def test_signing_in_anew_ends_the_session_before(desk: PeoplesDesk) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        before = page.cookies["iveg"]
        await enter(page, name=ANA.name, password="acelga-1234")

    assert desk.authenticator.sessions.find(before) is None


async def test_another_sites_page_signs_nobody_in(desk: PeoplesDesk) -> None:
    async with desk.stranger() as page:
        status = await enter(page, name=ANA.name, password="acelga-1234")

    assert status == 403
    assert desk.passwords.asked == []


async def test_the_audit_has_the_sign_in_and_no_password(desk: PeoplesDesk) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="wrong-password")
        await enter(page, name=ANA.name, password="acelga-1234")

    rows = desk.records(AuditRecord)
    assert [(one.action, one.person, one.method) for one in rows] == [
        ("sign_in_refused", "", "none"),
        ("sign_in", "P1", "password"),
    ]
    assert "password" not in "".join(one.details for one in rows)


@pytest.mark.parametrize(
    ("chief", "is_said"),
    [
        (None, True),
        (Account("P9", "Chief", "admin", password="#x"), False),
        (Account("P9", "Chief", "admin"), True),
        (Account("P9", "Chief", "admin", password="#x", disabled=True), True),
        (Account("P9", "Chief", "operator", password="#x"), True),
    ],
)
async def test_until_somebody_is_admin_every_page_says_so_and_a_program_stops(
    desk: PeoplesDesk,
    monkeypatch: pytest.MonkeyPatch,
    chief: Account | None,
    *,
    is_said: bool,
) -> None:
    monkeypatch.setattr(desk.pages, "_is_ready", desk.people.is_led)
    desk.authenticator._api_token = "a-token-for-programs"
    if chief is not None:
        desk.accounts.known["P9"] = chief
    await desk.people.refresh()
    html = {"Accept": "text/html"}
    async with desk.page() as page, desk.program() as program:
        strangers = [await page.get(one, headers=html) for one in ("/", "/signin")]
        await enter(page, name=ANA.name, password="acelga-1234")
        own = [await page.get(one, headers=html) for one in ("/", "/users", "/none")]
        stopped = await program.post("/api/v1/robots/AGI/stop")

    shown = [*strangers, *own]
    assert [one.status_code for one in shown] == [401, 200, 200, 403, 404]
    assert ['id="unready"' in one.text for one in shown] == [is_said] * 5
    assert stopped.status_code == 202


async def test_an_expired_session_can_still_stop_and_sign_out(
    desk: PeoplesDesk,
) -> None:
    async with desk.page() as page:
        await enter(page, name=ANA.name, password="acelga-1234")
        desk.clock.now += 13 * 3600.0
        read = await page.get("/api/v1/robots")
        stopped = await page.post("/api/v1/robots/AGI/stop")
        token = page.cookies["iveg"]
        left = await page.post("/signout")

    assert [one.status_code for one in (read, stopped, left)] == [403, 202, 303]
    assert desk.authenticator.sessions.find(token) is None
