"""Issue 13.22: the evening sheet as numbers and on paper, in both languages."""

import re
from collections.abc import AsyncIterator
from datetime import date
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

from iveg.adapters.history.engine import writing_engine
from iveg.adapters.history.upkeep import purge_piece
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from iveg.domain.retention import DAY_S, PURGE_STEPS
from iveg.models.history import Day
from iveg.web.api import day
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.sentences import start_of
from iveg.web.security.requirements import require
from tests.databases import remember
from tests.fakes.records import (
    alert_record,
    command_record,
    decision_record,
    detection_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker

Client = httpx.AsyncClient

LANE = DriveLane("1", Rectangle(0, 0, 20, 4))
GREENHOUSE = Greenhouse("house", Rectangle(0, 0, 20, 20), lanes=(LANE,))
MORNING = start_of(date(2026, 11, 20)) + 9 * 3600.0
RECORDS: tuple[Record, ...] = (
    *(odometry_record(at=MORNING + n / 2, x=5.0, y=2.0) for n in range(240)),
    detection_record(at=MORNING + 10.0, x=6.0, y=2.0, person_id="P1"),
    decision_record(x=6.0, y=2.0, started_at=MORNING, ended_at=MORNING + 90.0),
    command_record(requested_at=MORNING, standing_at=MORNING, standstill_ms=412.0),
    command_record(command_id="C2", kind="release", requested_at=MORNING + 5.0),
    alert_record(priority="P1", acknowledged_at=None, raised_at=MORNING),
)


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'history.db'}"


@pytest.fixture
async def browser(url: str) -> AsyncIterator[Client]:
    """A viewer an hour later."""
    remember(url, *RECORDS)

    async def read(wanted: date, now: float) -> Day:
        return await FakeWorker().run(day.read_day, url, GREENHOUSE, wanted, now)

    pages = Pages(Site("house", ("AGI",), "1", demo=False))
    app = FastAPI()
    app.dependency_overrides[require("read")] = lambda: None
    app.include_router(day.router(read, pages, lambda: Instant(0.0, MORNING + 3600.0)))
    transport = httpx.ASGITransport(app=app)
    async with Client(transport=transport, base_url="http://iveg") as client:
        yield client


async def test_a_day_is_told_in_numbers(browser: Client) -> None:
    told = (await browser.get("/api/v1/day", params={"day": "2026-11-20"})).json()

    assert told["worked"] == [{"lane": "1", "robot_id": "AGI", "minutes": 2.0}]
    assert told["slowed"] == [{"cause": "person", "lane": "1", "minutes": 1.5}]
    assert [one["distance_m"] for one in told["passes"]] == [1.0]
    assert [one["standstill_ms"] for one in told["stops"]] == [412.0]
    assert told["unseen"] == 1


async def test_what_a_day_has_lost_is_not_told_as_nothing(
    browser: Client, url: str
) -> None:
    engine = writing_engine(url)
    with engine.begin() as connection:
        for step in PURGE_STEPS:
            if step.kind in ("positions", "telemetry"):
                purge_piece(connection, step, MORNING + DAY_S)
    engine.dispose()
    english = {"Accept-Language": "en"}
    html = (await browser.get("/day?day=2026-11-20", headers=english)).text

    assert "worked 0 min" not in html
    assert "no robot drove in an aisle, or it is no longer kept" in html
    assert "near anybody who was seen, or it is no longer kept" in html
    assert "outside the aisles, or no longer kept" in html


async def test_28_6_the_sheet_begins_with_the_day_in_a_sentence_and_on_a_plan(
    browser: Client,
) -> None:
    asked = {"day": "2026-11-20"}, {"Accept-Language": "en"}
    html = (await browser.get("/day", params=asked[0], headers=asked[1])).text
    plan = html[html.index("sheet__plan") : html.index("</figure>")]

    assert "worked 2 min in all in the aisles and drove slowly for 2 min" in html
    assert "Nearest to a person: 1.0 m" in html
    # The lane lies along the house, 20 m of it: 2 of 2 minutes, and 1.5 of 2.
    bars = re.findall(r'sheet__(\w+)" x="0.0" y="[\d.]+" width="([\d.]+)"', plan)
    assert bars == [("worked", "20.0"), ("slowed", "15.0")]
