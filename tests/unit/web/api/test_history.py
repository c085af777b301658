import csv
import io
import sqlite3
from collections.abc import AsyncIterator
from contextlib import closing
from functools import partial
from pathlib import Path

import httpx
import orjson
import pytest
from fastapi import FastAPI

from iveg.adapters.history.queries import Queries
from iveg.domain.observations import Instant
from iveg.domain.records import DecisionRecord, ReadingRecord
from iveg.models.history import Alert
from iveg.web import problems
from iveg.web.api import exports
from iveg.web.api.history import router
from iveg.web.security.requirements import require
from tests.databases import remember
from tests.fakes.records import (
    NOON,
    alert_record,
    climate_record,
    decision_record,
    detection_record,
    log_record,
    measurement_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker

Client = httpx.AsyncClient


class Past:
    """A history with a door."""

    def __init__(self, directory: Path) -> None:
        self._file = directory / "history.db"
        url = f"sqlite:///{self._file}"
        self.holds = partial(remember, url)
        self.holds()
        self.queries = Queries(url)
        self.alerts: list[Alert] = []
        self.open: dict[str, DecisionRecord] = {}
        self.app = FastAPI()
        self.app.dependency_overrides[require("read")] = lambda: None
        self.app.include_router(
            router(
                self.queries,
                FakeWorker(),
                present=self.open.get,
                alerts=lambda: self.alerts,
                read_clock=lambda: Instant(0.0, NOON + 60.0),
            )
        )
        problems.install(self.app)

    def spoils(self, statement: str) -> None:
        """Somebody's hand in the file."""
        with closing(sqlite3.connect(self._file)) as hand, hand:
            hand.execute(statement)


@pytest.fixture
async def past(tmp_path: Path) -> AsyncIterator[Past]:
    past = Past(tmp_path)
    yield past
    past.queries.close()


@pytest.fixture
async def client(past: Past) -> AsyncIterator[Client]:
    transport = httpx.ASGITransport(app=past.app)
    async with Client(transport=transport, base_url="http://iveg") as client:
        yield client


async def test_alerts_of_now_come_from_memory_whatever_the_database_says(
    client: Client, past: Past
) -> None:
    past.holds(*(alert_record(alert_id=one) for one in ("A1", "A2")))
    past.alerts = [Alert.from_record(alert_record(alert_id="A1", note="seen"))]

    async def told() -> list[tuple[str, str | None]]:
        items = (await client.get("/api/v1/alerts")).json()["items"]
        return [(one["alert_id"], one["note"]) for one in items]

    whole = await told()
    past.spoils("DROP TABLE alerts")
    spoilt = await told()
    filtered = await client.get("/api/v1/alerts?robot=AGI")

    assert whole == [("A1", "seen"), ("A2", None)]
    assert spoilt == [("A1", "seen")]
    assert filtered.status_code == 503


@pytest.mark.parametrize(
    ("fields", "key"),
    [
        ({"in_sight": True}, "log.speed_down.person"),
        ({"in_sight": None, "reason": "stale"}, "log.speed_down.stale"),
        ({"in_sight": None, "reason": None}, "log.speed_down.default"),
        ({"kind": "alert"}, "log.person_seen"),
    ],
)
async def test_each_kind_of_decision_has_its_sentence(
    client: Client, past: Past, fields: dict[str, object], key: str
) -> None:
    past.holds(decision_record(**fields))

    assert (await client.get("/api/v1/decisions/D1")).json()["sentence"]["key"] == key


@pytest.mark.parametrize(
    ("query", "ids"),
    [
        ("since=2023-11-14T22:13:21Z", [2, 1]),
        ("since=2023-11-14T23:13:21+01:00", [2, 1]),
        ("until=2023-11-14T22:13:21", [0]),
        ("robot=AGII&class=person", []),
        ("class=person", [1]),
    ],
)
async def test_filters_are_read_from_the_address(
    client: Client, past: Past, query: str, ids: list[int]
) -> None:
    past.holds(
        log_record(id=0),
        log_record(id=1, at=NOON + 1, class_="person"),
        log_record(id=2, at=NOON + 2, robot_id="AGII"),
    )

    answer = (await client.get(f"/api/v1/log?{query}")).json()

    assert [item["id"] for item in answer["items"]] == ids


@pytest.mark.parametrize(
    "query",
    [
        "since=yesterday",
        "since=2024-01-02T00:00:00Z&until=2024-01-01T00:00:00Z",
        "robot=a/b",
        "class=%00",
        "min_probability=nan",
        "limit=1001",
        "cursor=nonsense",
        "probability=0.5",
    ],
)
async def test_a_filter_that_cannot_be_used_is_refused_and_not_overlooked(
    client: Client, query: str
) -> None:
    answer = await client.get(f"/api/v1/detections?{query}")

    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"


async def test_a_spreadsheet_runs_nothing_from_a_csv(
    client: Client, past: Past
) -> None:
    past.holds(*(alert_record(alert_id=one, note=f"{one}cmd()") for one in "=+-@\t"))

    answer = await client.get("/api/v1/alerts", params={"format": "csv"})

    notes = {row["note"] for row in csv.DictReader(io.StringIO(answer.text))}
    assert notes == {f"'{one}cmd()" for one in "=+-@\t"}


async def test_an_export_runs_through_every_page(client: Client, past: Past) -> None:
    past.holds(*(log_record(id=n, at=NOON + n) for n in range(2345)))

    everything = await client.get("/api/v1/log", params={"format": "ndjson"})
    some = await client.get("/api/v1/log", params={"format": "ndjson", "limit": 7})

    ids = [orjson.loads(line)["id"] for line in everything.text.splitlines()]
    assert ids == list(range(2345))[::-1]
    assert len(some.text.splitlines()) == 7


async def test_charts_show_the_last_quarter_of_an_hour(
    client: Client, past: Past
) -> None:
    past.holds(
        odometry_record(at=NOON - 3600.0),
        odometry_record(at=NOON, linear=0.9),
        odometry_record(at=NOON + 1, linear=0.4, limit_factor=0.5),
        odometry_record(at=NOON + 31, linear=0.0, limit_factor=0.5),
    )

    figures = (await client.get("/api/v1/history/charts")).json()["figures"]

    speed, limit = figures["speed/AGI"]["data"]
    assert speed["meta"] == {"kind": "speed", "robot": "AGI", "slice_s": 0.0}
    assert speed["y"] == [0.9, 0.4, None, 0.0]
    assert speed["x"][0] == 1000.0 * NOON
    assert limit["y"] == [1.0, 0.5, None, 0.5]
    assert limit["line"]["shape"] == "hv"


async def test_the_air_of_a_day_is_drawn_with_its_gaps(
    client: Client, past: Past
) -> None:
    past.holds(
        climate_record(at=NOON - 86_400.0),
        climate_record(at=NOON - 3600.0, temperature=16.25, co2=None),
        climate_record(at=NOON, co2=None),
    )

    air = (await client.get("/api/v1/history/climate")).json()

    assert air["until"] == "2023-11-14T22:14:20.000Z"
    # The line breaks between readings that are an hour apart.
    [warmth] = air["figures"]["temperature"]["data"]
    assert warmth["y"] == [16.25, None, 21.5]
    assert warmth["meta"]["slice_s"] == 300.0
    [humidity] = air["figures"]["humidity"]["data"]
    assert humidity["y"] == [70.0, None, 70.0]
    assert air["figures"]["co2"]["data"] == []


async def test_each_column_of_what_was_measured_is_a_key_of_its_json(
    client: Client, past: Past
) -> None:
    past.holds(
        detection_record(person_id="P1"),
        odometry_record(),
        ReadingRecord(at=NOON, robot_id="AGI", kind="battery", value={"voltage": 25}),
        measurement_record(),
    )

    for path in ("detections", "tracks", "odometry", "readings", "measurements"):
        [item] = (await client.get(f"/api/v1/{path}")).json()["items"]
        lines = (await client.get(f"/api/v1/{path}?format=csv")).text
        [row] = csv.DictReader(io.StringIO(lines))
        assert row == {name: exports.cell(item[name]) for name in row}
