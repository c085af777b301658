"""A shared tablet: by name for two minutes, and STOP whoever it is."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from typing import Any

import httpx
import pytest

from iveg.domain.records import AuditRecord
from iveg.web.api import tablet
from iveg.web.security.tablets import TABLET_S
from tests.unit.web.api.test_commands import stopped
from tests.unit.web.security.test_people import ANA
from tests.unit.web.security.test_proofs import PROOF, RELEASE, STOP, ProofsDesk

STATE, UNLOCK, LOCK = "/api/v1/tablet", "/api/v1/tablet/unlock", "/api/v1/tablet/lock"
PIN = "/api/v1/account/pin"
BOSS = replace(ANA, account_id="P8", name="Boss", role="admin", pin="#8642")
EVE = replace(ANA, account_id="P9", name="Eve", role="viewer", pin="#97531")
Body = dict[str, Any]


class TabletsDesk(ProofsDesk):
    """A desk with a tablet on the wall; Ana, Boss and Eve have a PIN."""

    def __init__(self) -> None:
        super().__init__()
        self.app.include_router(tablet.router(self.people, self.pins))
        known = (replace(ANA, pin="#2580"), BOSS, EVE)
        self.accounts.known |= {one.account_id: one for one in known}

    @asynccontextmanager
    async def tablet(self) -> AsyncIterator[httpx.AsyncClient]:
        async with self.ana() as page:
            made = await page.post(STATE, json={"name": "Nave 2"})
            assert made.status_code == 201
            yield page

    async def unlock(
        self, page: httpx.AsyncClient, person_id: str = "P1", pin: str = "2580"
    ) -> httpx.Response:
        return await page.post(UNLOCK, json={"person_id": person_id, "pin": pin})

    def role(self) -> str:
        (session,) = self.authenticator.sessions._sessions.values()
        who = self.authenticator.sessions._principal(
            bytes.fromhex(session.digest), touch=False
        )
        return f"{who.name} {who.role}" if who else ""


@pytest.fixture
async def desk() -> AsyncIterator[TabletsDesk]:
    desk = TabletsDesk()
    await desk.people.refresh()
    yield desk
    desk.close()


async def test_a_tablet_reads_and_stops_and_releases_nothing(desk: TabletsDesk) -> None:
    async with desk.tablet() as page:
        state = (await page.get(STATE)).json()
        read = await page.get("/api/v1/robots")
        stop = await page.post(STOP)
        refused = await desk.release(page)

    assert (state["name"], state["holder"], state["role"]) == ("Nave 2", None, "viewer")
    assert [one["name"] for one in state["people"]] == ["Ana Núñez", "Boss", "Eve"]
    assert (read.status_code, stop.status_code) == (200, 202)
    assert refused == (403, "urn:iveg:not-allowed")
    command = next(iter(desk.commander.commands.values()))
    assert command.requesters[0] == "Nave 2"


@pytest.mark.parametrize(
    ("person_id", "pin", "said"),
    [
        ("P1", "2580", "Ana Núñez operator"),
        ("P8", "8642", "Boss operator"),
        ("P9", "97531", "Eve viewer"),
    ],
)
async def test_a_pin_unlocks_it_as_its_person_and_as_operator_at_most(
    desk: TabletsDesk, person_id: str, pin: str, said: str
) -> None:
    async with desk.tablet() as page:
        answer = await desk.unlock(page, person_id, pin)

    assert answer.status_code == 200
    assert desk.role() == said
    assert answer.json()["left_s"] == 120.0


async def test_it_locks_two_minutes_after_the_last_act_which_a_stop_is_not(
    desk: TabletsDesk,
) -> None:
    acts = {"note": ("/api/v1/things", {"person_id": "P7-k3"}), "stop": (STOP, {})}
    seen = {}
    for name, (path, body) in acts.items():
        async with desk.tablet() as page:
            await desk.unlock(page)
            desk.clock.now += 100.0
            await page.post(path, json=body)
            await page.get("/api/v1/robots")
            desk.clock.now += 100.0
            seen[name] = (await page.get(STATE)).json()["holder"]

    assert seen == {"note": "Ana Núñez", "stop": None}


async def test_f_after_two_minutes_a_release_is_refused_and_a_stop_works(
    desk: TabletsDesk,
) -> None:
    async with desk.tablet() as page:
        await desk.unlock(page)
        hold = await stopped(desk)
        desk.clock.now += 121.0
        refused = await page.post(RELEASE, json={"holds": [hold]})
        stop = await page.post(STOP)

    assert (refused.status_code, stop.status_code) == (403, 202)


async def test_a_release_on_it_is_its_persons_by_name(desk: TabletsDesk) -> None:
    async with desk.tablet() as page:
        await desk.unlock(page)
        released = await desk.release(page)
        locked = (await page.post(LOCK)).json()
        refused = await page.post(RELEASE, json={"holds": ["x"]})

    assert released == (202, "")
    assert (locked["holder"], locked["left_s"]) == (None, 0.0)
    assert refused.status_code == 403
    rows = [one for one in desk.records(AuditRecord) if one.action == "release"]
    assert [(one.name, one.person, one.method) for one in rows] == [
        ("Ana Núñez", "P1", "pin"),
        ("Nave 2", "tablet", "tablet"),
    ]


async def test_five_wrong_pins_block_that_person_for_growing_times_and_no_other(
    desk: TabletsDesk,
) -> None:
    blocks = []
    async with desk.tablet() as page:
        for _ in range(3):
            wrong = [await desk.unlock(page, pin="0000") for _ in range(5)]
            assert [one.status_code for one in wrong] == [403] * 5
            right = await desk.unlock(page)
            assert right.json()["type"] == "urn:iveg:pin-blocked"
            blocks.append(int(right.headers["retry-after"]))
            desk.clock.now += blocks[-1] + 1.0
        other = await desk.unlock(page, "P8", "8642")
        own = await desk.unlock(page)

    assert blocks == [60, 240, 960]
    assert (other.status_code, own.status_code) == (200, 200)
    told = [
        one.details for one in desk.records(AuditRecord) if "blocked_s" in one.details
    ]
    assert any('"blocked_s":240' in one and '"person_id":"P1"' in one for one in told)
    assert "2580" not in "".join(told)


async def test_a_right_pin_forgets_the_wrong_ones_before(desk: TabletsDesk) -> None:
    async with desk.tablet() as page:
        statuses = [
            (await desk.unlock(page, pin=pin)).status_code
            for pin in ("0000", "0000", "0000", "0000", "2580") * 3
        ]

    assert statuses == [403, 403, 403, 403, 200] * 3


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({"person_id": "P2", "pin": "2580"}, 403),
        ({"person_id": "nobody", "pin": ""}, 403),
        ({"person_id": "P1", "pin": "123456789"}, 422),
        ({"person_id": "P1", "pin": 2580}, 422),
        ({"person_id": "P1"}, 422),
    ],
)
async def test_what_is_nobodys_pin_unlocks_nothing(
    desk: TabletsDesk, body: Body, status: int
) -> None:
    async with desk.tablet() as page:
        assert (await page.post(UNLOCK, json=body)).status_code == status
        assert (await page.get(STATE)).json()["holder"] is None


@pytest.mark.parametrize(
    "changed", [{"disabled": True}, {"pin": ""}, {"since": 9e9}, {"password": ""}]
)
async def test_who_is_shut_out_or_reset_holds_no_tablet(
    desk: TabletsDesk, changed: Body
) -> None:
    async with desk.tablet() as page:
        await desk.unlock(page)
        desk.accounts.known["P1"] = replace(ANA, **{"pin": "#2580", **changed})
        await desk.people.refresh()
        state = (await page.get(STATE)).json()
        stop = await page.post(STOP)

    assert (state["holder"], stop.status_code) == (None, 202)


async def test_the_own_pin_proves_it_anew_and_a_tablet_asks_after_a_while_too(
    desk: TabletsDesk,
) -> None:
    async with desk.tablet() as page:
        await desk.unlock(page)
        for _ in range(10):
            desk.clock.now += 100.0
            await page.post("/api/v1/things", json={"person_id": "P7-k3"})
        hold = await stopped(desk)
        asked = await page.post(RELEASE, json={"holds": [hold]})
        given = await page.post(PROOF, json={"pin": "2580"})
        released = await page.post(RELEASE, json={"holds": [hold]})

    assert asked.json()["type"] == "urn:iveg:proof-needed"
    assert (given.status_code, released.status_code) == (204, 202)


@pytest.mark.parametrize("path", [STATE, UNLOCK, LOCK])
async def test_what_is_no_tablet_says_so(desk: TabletsDesk, path: str) -> None:
    async with desk.ana() as page:
        body = {"person_id": "P1", "pin": "2580"}
        answer = (
            await page.get(path) if path == STATE else await page.post(path, json=body)
        )

    assert answer.status_code == 404


async def test_a_tablet_makes_no_tablet_and_chooses_no_pin_or_passkey(
    desk: TabletsDesk,
) -> None:
    async with desk.tablet() as page:
        await desk.unlock(page)
        refused = [
            await page.post(STATE, json={"name": "x"}),
            await page.put(PIN, json={"pin": "2580"}),
            await page.get("/api/v1/account/passkeys/options"),
        ]

    assert [one.status_code for one in refused] == [409, 404, 404]


@pytest.mark.parametrize(
    ("pin", "status"),
    [
        ("8025", 204),
        ("80258025", 204),
        ("802", 422),
        ("1111", 422),
        ("4321", 422),
        ("٨٠٢٥", 422),
        ("80a5", 422),
        ("802580258", 422),
    ],
)
async def test_a_pin_is_four_to_eight_digits_that_nobody_guesses_first(
    desk: TabletsDesk, pin: str, status: int
) -> None:
    async with desk.ana() as ana:
        answer = await ana.put(PIN, json={"pin": pin})
    kept = desk.accounts.known["P1"].pin

    assert answer.status_code == status
    assert kept == (f"#{pin}" if status == 204 else "#2580")


async def test_a_new_pin_asks_for_a_fresh_proof_and_is_in_the_audit_without_it(
    desk: TabletsDesk,
) -> None:
    async with desk.ana() as ana:
        chosen = await ana.put(PIN, json={"pin": "8025"})
        gone = await ana.delete(PIN)
        desk.clock.now += 901.0
        stale = await ana.put(PIN, json={"pin": "8025"})

    assert [one.status_code for one in (chosen, gone, stale)] == [204, 204, 403]
    assert desk.accounts.changes == [
        ("pin_changed", ANA.name, ANA.name),
        ("pin_removed", ANA.name, ANA.name),
    ]


async def test_a_tablet_outlives_a_day_and_ends_in_a_month(
    desk: TabletsDesk,
) -> None:
    async with desk.tablet() as page:
        desk.clock.now += TABLET_S - 1.0
        reads = await page.get("/api/v1/robots")
        desk.clock.now += 2.0
        over = await page.get("/api/v1/robots")
        stop = await page.post(STOP)

    assert [one.status_code for one in (reads, over, stop)] == [200, 403, 202]
