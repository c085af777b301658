"""Issue 25, 5: what two ranges cost and how near it was, from rows of the history."""

from collections.abc import AsyncIterator, Mapping
from functools import partial
from pathlib import Path

import httpx
import pytest

from iveg.adapters.history.engine import writing_engine
from iveg.adapters.history.purge import purge_batch
from iveg.domain.records import Record
from iveg.domain.retention import DAY_S, PURGE_STEPS
from iveg.domain.stamps import format_stamp
from iveg.web.api import cost
from tests.fakes.records import (
    alert_record,
    command_event_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker
from tests.unit.web.api.sheets import GREENHOUSE, MORNING, reader


def _speed(at: float, factor: float, reason: str, **more: str) -> Record:
    slots = {"factor": factor, "reason": reason}
    return log_record(id=int(at * 10), at=at, kind="speed", slots=slots, **more)


def _drive(since: float, seconds: float, **fields: object) -> list[Record]:
    return [
        odometry_record(at=since + n / 2, y=2.0, **fields)
        for n in range(int(2 * seconds))
    ]


RECORDS: list[Record] = [
    # Free for a minute at 1 m/s, slow for two in aisle 1, held for one, in a goal.
    *_drive(MORNING, 60, x=5.0, linear=1.0),
    _speed(MORNING + 60, 0.5, "person", decision_id="D1"),
    *_drive(MORNING + 60, 120, x=5.0, linear=0.5, applied_factor=0.5, margin_m=-2.5),
    _speed(MORNING + 180, 0.0, "hold"),
    *_drive(MORNING + 180, 60, x=5.0, linear=0.0, applied_factor=0.0),
    _speed(MORNING + 240, 1.0, "clear"),
    detection_record(at=MORNING + 70.2, x=5.0, y=3.2, person_id="P1"),
    detection_record(at=MORNING + 71.2, x=5.0, y=3.0, person_id="P1"),
    # Near, and slow, and yet 1.6 m away.
    detection_record(at=MORNING + 100.2, x=6.6, y=2.0, person_id="P1"),
    decision_record(decision_id="D1", started_at=MORNING + 60),
    command_record(
        command_id="G1", kind="goal", state="REACHED", requested_at=MORNING + 30
    ),
    command_event_record(command_id="G1", at=MORNING + 300, state="REACHED"),
    command_record(command_id="C1", requested_at=MORNING + 180),
    command_record(command_id="C2", requested_at=MORNING + 190, drill=True),
    alert_record(priority="P2", last_raised_at=MORNING + 10),
]


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'history.db'}"


def _reading(url: str, braking: Mapping[str, float]) -> cost.ReadCost:
    return lambda since, until: FakeWorker().run(
        cost.read_cost, url, GREENHOUSE, braking, since, until
    )


@pytest.fixture
async def browser(url: str) -> AsyncIterator[httpx.AsyncClient]:
    read = _reading(url, {"AGI": 1.0})
    async with reader(url, RECORDS, partial(cost.router, read)) as client:
        yield client


def _asked(
    since: float = MORNING - 60, until: float = MORNING + 3600
) -> dict[str, str]:
    return {"since": format_stamp(since), "until": format_stamp(until)}


async def test_a_range_is_told_in_numbers(browser: httpx.AsyncClient) -> None:
    told = (await browser.get("/api/v1/cost", params=_asked())).json()

    assert told["slowed"] == [{"cause": "person", "lane": "1", "minutes": 2.0}]
    assert (told["stops"], told["drills"], told["encounters"]) == (1, 1, 1)
    assert [(one["priority"], one["count"]) for one in told["alerts"]] == [("P2", 1)]


async def test_a_near_miss_is_where_people_were_and_leads_to_its_decision(
    browser: httpx.AsyncClient,
) -> None:
    told = (await browser.get("/api/v1/cost", params=_asked())).json()

    (miss,) = told["near"]
    assert miss["at"] == format_stamp(MORNING + 71.0)
    assert (miss["distance_m"], miss["seconds"]) == (1.0, 2)
    assert (miss["lane"], miss["decision_id"]) == ("1", "D1")
    assert told["heat"] == [{"x": 5.0, "y": 2.0, "seconds": 2}]


async def test_robots_of_which_nothing_is_described_brake_as_the_worst(
    url: str,
) -> None:
    async with reader(url, RECORDS, partial(cost.router, _reading(url, {}))) as client:
        told = (await client.get("/api/v1/cost", params=_asked())).json()

    assert [one["distance_m"] for one in told["near"]] == [1.0]


async def test_lost_time_is_counted_against_the_robots_own_free_speed(
    browser: httpx.AsyncClient,
) -> None:
    (goal,) = (await browser.get("/api/v1/cost", params=_asked())).json()["tasks"]

    assert (goal["command_id"], goal["free_speed"]) == ("G1", 1.0)
    # Two minutes at half of it and one at none: 60 m and 60 m.
    assert (goal["slowed_minutes"], goal["held_minutes"]) == (2.0, 1.0)
    assert (goal["lost_m"], goal["lost_minutes"]) == (120.0, 2.0)


@pytest.mark.parametrize(
    ("kind", "lost", "known"),
    [
        ("positions", ["places"], ("slowed", "tasks", "stops")),
        ("telemetry", ["places", "telemetry"], ("stops",)),
    ],
)
async def test_what_retention_took_is_unknown_and_not_nothing(
    browser: httpx.AsyncClient,
    url: str,
    kind: str,
    lost: list[str],
    known: tuple[str, ...],
) -> None:
    with writing_engine(url).begin() as connection:
        for step in (one for one in PURGE_STEPS if one.kind == kind):
            purge_batch(connection, step, MORNING + DAY_S, lambda: 0.0)

    told = (await browser.get("/api/v1/cost", params=_asked(MORNING))).json()

    assert [one for one in told["lost"] if one != "events"] == lost
    unknown = {"near", "near_count", "heat", "slowed", "tasks", "stops"} - {*known}
    assert {key for key in (*unknown, *known) if told[key] is None} == unknown


async def test_two_ranges_stand_side_by_side_and_what_is_unknown_is_said(
    browser: httpx.AsyncClient,
) -> None:
    # A form tells the wall clock of Madrid, a link any offset.
    asked = {
        "since": "2026-11-20 08:00",
        "until": "2026-11-20T10:30:00+02:00",
        "than_since": "2026-11-01T00:00:00",
        "than_until": "2026-11-02T00:00:00",
    }
    page = (
        await browser.get("/compare", params=asked, headers={"Accept-Language": "en"})
    ).text

    assert "Where robots drove is kept from 20/11/2026 09:00 on" in page
    assert "AGI: 1.0 m from a person, at 0.50 m/s" in page
    assert 'href="/decisions/D1"' in page
    assert f'href="/?t={format_stamp(MORNING + 61.0)}"' in page
    assert 'href="/commands/G1"' in page
    assert page.count("Not known: the history") == 2
    # The form repeats it, in words of the page's own and not of the browser's.
    assert 'name="since" value="2026-11-20 08:00:00"' in page
    assert "Year-month-day hour:minute, Europe/Madrid time" in page


@pytest.mark.parametrize("path", ["/api/v1/cost", "/compare"])
@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (_asked(MORNING, MORNING - 1), "since is after until"),
        ({"since": "1926-11-20T09:00:00Z"}, "no day of any history"),
        (_asked(MORNING - 40 * DAY_S), "a chart shows 31 days at most"),
        ({"since": "2026-11-20T09:00:00[Mars/Olympus]"}, "invalid"),
    ],
)
async def test_a_range_that_cannot_be_is_refused_in_one_sentence(
    browser: httpx.AsyncClient, path: str, asked: dict[str, str], said: str
) -> None:
    answer = await browser.get(path, params=asked)

    assert answer.status_code == 422
    assert said in answer.text
