import csv
import gzip
import importlib.resources
import io
import re
import sqlite3
import sys
from collections.abc import AsyncIterator
from contextlib import closing
from pathlib import Path

import httpx
import orjson
import pytest
from fastapi import FastAPI
from pyarrow import parquet

from iveg.adapters.history.queries import Queries
from iveg.adapters.history.store import Store
from iveg.domain.errors import NotAllowedError
from iveg.domain.observations import Instant
from iveg.domain.records import DecisionRecord, ReadingRecord, Record
from iveg.domain.stamps import format_stamp
from iveg.pipeline.record import Waiting
from iveg.web import problems
from iveg.web.api import exports
from iveg.web.api.history import router
from iveg.web.pages import plotly_library
from iveg.web.security.requirements import require
from tests.databases import lay_history
from tests.fakes.records import (
    NOON,
    alert_record,
    climate_record,
    command_event_record,
    command_record,
    decision_record,
    detection_record,
    log_record,
    measurement_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker

LISTS = (
    *("decisions", "detections", "commands", "alerts", "log", "readings"),
    *("tracks", "odometry", "measurements"),
)


class Past:
    """A history with a door."""

    def __init__(self, directory: Path, *, open_: bool = True) -> None:
        self._file = directory / "history.db"
        url = f"sqlite:///{self._file}"
        lay_history(url)
        self._store = Store(url)
        self._queries = Queries(url)
        self._open = open_
        self.present: dict[str, DecisionRecord] = {}
        self.app = FastAPI()
        self.app.dependency_overrides[require("read")] = self._reader
        self.app.include_router(
            router(
                self._queries,
                FakeWorker(),
                threshold=lambda: 0.8,
                present=self.present.get,
                read_clock=lambda: Instant(0.0, NOON + 60.0),
            )
        )
        problems.install(self.app)
        self.holds()

    def _reader(self) -> None:
        if not self._open:
            raise NotAllowedError("read", "nobody")

    def holds(self, *records: Record) -> None:
        rows = [Waiting(record, n, 0.0) for n, record in enumerate(records, 1)]
        self._store.write(rows)

    def spoils(self, statement: str) -> None:
        """Somebody's hand in the file."""
        with closing(sqlite3.connect(self._file)) as hand, hand:
            hand.execute(statement)

    def close(self) -> None:
        self._queries.close()
        self._store.close()


@pytest.fixture
async def past(tmp_path: Path) -> AsyncIterator[Past]:
    past = Past(tmp_path)
    yield past
    past.close()


@pytest.fixture
async def client(past: Past) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(app=past.app)
    async with httpx.AsyncClient(transport=transport, base_url="http://iveg") as client:
        yield client


@pytest.mark.parametrize("name", LISTS)
async def test_a_list_of_nothing_has_no_items_and_no_next_page(
    client: httpx.AsyncClient, name: str
) -> None:
    answer = await client.get(f"/api/v1/{name}")

    assert answer.status_code == 200
    body = answer.json()
    assert (body["items"], body["next"]) == ([], None)


async def test_a_detection_reads_as_the_contract_says(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(detection_record(person_id="P1"))

    [item] = (await client.get("/api/v1/detections")).json()["items"]

    assert item == {
        "robot_id": "AGI",
        "stamp": "2023-11-14T22:13:19.900Z",
        "received_at": "2023-11-14T22:13:20.000Z",
        "class": "person",
        "class_id": "farmer",
        "probability": 0.94,
        "position": {"x": -3.5, "y": 2.0, "z": 0.9},
        "box": {
            "xmin": -4.0,
            "xmax": -3.0,
            "ymin": 1.5,
            "ymax": 2.5,
            "zmin": 0.0,
            "zmax": 1.8,
            "frame_id": "map",
        },
        "confident": True,
        "person_id": "P1",
        "peer": None,
        "transport": "direct",
        "at": "2023-11-14T22:13:20.000Z",
        "x": -3.5,
        "y": 2.0,
        "z": 0.9,
        "late": False,
    }


async def test_a_command_reads_as_the_contract_says(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(command_record(sent_at={"direct": NOON + 0.003}, tries=1))

    [item] = (await client.get("/api/v1/commands")).json()["items"]

    told = {
        "command_id": "C1",
        "robot_id": "AGI",
        "kind": "stop",
        "drill": False,
        "state": "REQUESTED",
        "requested_by": "ana",
        "times": {
            "pressed": None,
            "requested": "2023-11-14T22:13:20.000Z",
            "sent": {"direct": "2023-11-14T22:13:20.003Z"},
            "answer": {},
            "standing": None,
        },
        "requested_at": "2023-11-14T22:13:20.000Z",
        "sent_direct_at": "2023-11-14T22:13:20.003Z",
        "standstill_ms": None,
        "tries": 1,
        "reason": None,
        "outcome": "open",
        "was_loud": False,
        "steps": [],
        "requesters": ["ana"],
    }
    live_only = {name: value for name, value in item.items() if name not in told}
    assert {name: item[name] for name in told} == told
    assert not any(live_only.values())


async def test_13_7_a_command_tells_each_step_and_that_it_was_not_confirmed(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(
        command_record(state="RUNNING", standing_at=NOON + 2.0),
        command_event_record(at=NOON, state="REQUESTED"),
        command_event_record(at=NOON + 1.0, state="UNCONFIRMED"),
        command_event_record(command_id="another", at=NOON + 1.0),
    )

    [item] = (await client.get("/api/v1/commands")).json()["items"]

    assert (item["outcome"], item["was_loud"]) == ("stood", True)
    assert [step["state"] for step in item["steps"]] == ["REQUESTED", "UNCONFIRMED"]


async def test_alerts_and_log_read_as_their_live_topics_do(
    client: httpx.AsyncClient, past: Past
) -> None:
    member = {"priority": "P2", "raised_at": NOON, "acknowledged_by": "ana"}
    past.holds(
        alert_record(members=[member]),
        log_record(class_="person", decision_id="D1"),
    )

    [alert] = (await client.get("/api/v1/alerts")).json()["items"]
    [entry] = (await client.get("/api/v1/log")).json()["items"]

    assert alert == {
        "alert_id": "A1",
        "priority": "P2",
        "key": "alert.person_slowed",
        "slots": {"robot": "AGI"},
        "robot_id": "AGI",
        "raised_at": "2023-11-14T22:13:20.000Z",
        "last_raised_at": "2023-11-14T22:13:20.000Z",
        "cleared_at": None,
        "acknowledged_at": None,
        "acknowledged_by": None,
        "note": None,
        "count": 1,
        "told": [],
        "members": [
            {
                "priority": "P2",
                "raised_at": "2023-11-14T22:13:20.000Z",
                "cleared_at": None,
                "acknowledged_at": None,
                "acknowledged_by": "ana",
                "note": None,
                "told": [],
            }
        ],
    }
    assert entry == {
        "id": 1,
        "at": "2023-11-14T22:13:20.000Z",
        "kind": "speed",
        "robot_id": "AGI",
        "key": "log.speed_up",
        "slots": {"robot": "AGI"},
        "class": "person",
        "decision_id": "D1",
    }


async def test_a_decision_tells_its_chain_and_its_sentence(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(decision_record())

    decision = (await client.get("/api/v1/decisions/D1")).json()

    assert decision["class"] == "person"
    assert decision["rule"]["parameters"] == {"radius_m": 2.0}
    assert decision["links"] == [
        {
            "link": "detection",
            "at": "2023-11-14T22:13:20.000Z",
            "value": "farmer",
            "verdict": "ok",
        }
    ]
    assert decision["sentence"]["key"] == "log.speed_down.person_nlos"
    assert decision["sentence"]["slots"]["distance"] == 1.43
    assert (await client.get("/api/v1/decisions")).json()["items"] == [decision]


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
    client: httpx.AsyncClient, past: Past, fields: dict[str, object], key: str
) -> None:
    past.holds(decision_record(**fields))

    assert (await client.get("/api/v1/decisions/D1")).json()["sentence"]["key"] == key


async def test_a_decision_whose_texts_were_spoilt_is_still_shown(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(decision_record(x=None), detection_record())
    past.spoils("UPDATE decisions SET links = '[{]', rule_parameters = ''")
    past.spoils("UPDATE detections SET box = '{'")

    decision = (await client.get("/api/v1/decisions/D1")).json()

    assert decision["links"] == []
    assert decision["rule"]["parameters"] == {}
    assert decision["position"] is None
    [seen] = (await client.get("/api/v1/detections")).json()["items"]
    assert seen["box"] is None


async def test_a_decision_in_memory_is_told_as_it_stands_now(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(decision_record(decision_id="D1", feedback_at=None))
    past.present["D1"] = decision_record(decision_id="D1", feedback_at=NOON)

    decision = (await client.get("/api/v1/decisions/D1")).json()

    assert decision["feedback_at"] is not None


async def test_a_decision_that_never_was_is_not_found(
    client: httpx.AsyncClient,
) -> None:
    answer = await client.get("/api/v1/decisions/nobody")

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"


async def test_pages_follow_each_other_by_cursor(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(*(log_record(id=n, at=NOON + n) for n in range(5)))

    first = (await client.get("/api/v1/log", params={"limit": 3})).json()
    rest = (
        await client.get("/api/v1/log", params={"limit": 3, "cursor": first["next"]})
    ).json()

    assert [item["id"] for item in first["items"] + rest["items"]] == [4, 3, 2, 1, 0]
    assert rest["next"] is None


async def test_28_9_a_list_is_sorted_and_a_cursor_is_of_one_order(
    client: httpx.AsyncClient, past: Past
) -> None:
    kinds = ("person", "alert", "person")
    past.holds(*(log_record(id=n, at=NOON + n, kind=k) for n, k in enumerate(kinds)))

    async def ask(**params: str) -> httpx.Response:
        return await client.get("/api/v1/log", params={"limit": "2", **params})

    first = (await ask(sort="-kind")).json()
    rest = (await ask(sort="-kind", cursor=first["next"])).json()
    others = [await ask(cursor=first["next"]), await ask(sort="priority")]

    assert [one["id"] for one in first["items"] + rest["items"]] == [2, 0, 1]
    assert [one.status_code for one in others] == [422, 422]
    assert "one of at, robot, kind" in others[1].text


@pytest.mark.parametrize(
    "other",
    [
        "log?robot=AGI",
        "log?since=2023-11-14T22:13:20Z",
        "log?class=person",
        "log?min_probability=0.5",
        "log?sort=at",
        "odometry?",
    ],
)
async def test_a_cursor_of_other_filters_is_refused(
    client: httpx.AsyncClient, past: Past, other: str
) -> None:
    past.holds(*(log_record(id=n, at=NOON + n) for n in range(3)))
    first = (await client.get("/api/v1/log?limit=1")).json()

    answer = await client.get(f"/api/v1/{other}&cursor={first['next']}")
    same = await client.get(f"/api/v1/log?limit=2&cursor={first['next']}")

    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert "a cursor of another list, order or filters" in answer.text
    assert [item["id"] for item in same.json()["items"]] == [1, 0]


@pytest.mark.parametrize(
    ("query", "ids"),
    [
        ("since=2023-11-14T22:13:21Z", [2, 1]),
        ("since=2023-11-14T23:13:21%2B01:00", [2, 1]),
        ("since=2023-11-14T23:13:21+01:00", [2, 1]),
        ("until=2023-11-14T22:13:21", [0]),
        ("robot=AGII", [2]),
        ("class=person", [1]),
    ],
)
async def test_filters_are_read_from_the_address(
    client: httpx.AsyncClient, past: Past, query: str, ids: list[int]
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
        "robot=",
        "class=%00",
        "min_probability=nan",
        "min_probability=1.1",
        "limit=0",
        "limit=1001",
        "limit=ten",
        "cursor=nonsense",
        "sort=robot",
        "sort=--at",
        "format=xml",
        "probability=0.5",
    ],
)
async def test_a_filter_that_cannot_be_used_is_refused_and_not_overlooked(
    client: httpx.AsyncClient, query: str
) -> None:
    answer = await client.get(f"/api/v1/detections?{query}")

    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize(
    "path", [*LISTS, "decisions/D1", "history/charts", "history/climate"]
)
async def test_whoever_may_not_read_gets_nothing(tmp_path: Path, path: str) -> None:
    past = Past(tmp_path, open_=False)
    transport = httpx.ASGITransport(app=past.app)

    async with httpx.AsyncClient(transport=transport, base_url="http://iveg") as client:
        answer = await client.get(f"/api/v1/{path}")

    past.close()
    assert answer.status_code == 403


async def test_csv_has_a_column_a_field_and_times_in_utc(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(detection_record())

    answer = await client.get("/api/v1/detections", headers={"Accept": "text/csv"})

    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert "detections.csv" in answer.headers["content-disposition"]
    [row] = csv.DictReader(io.StringIO(answer.text))
    assert row["at"] == "2023-11-14T22:13:20.000Z"
    assert row["class"] == "person"
    assert (row["x"], row["confident"], row["person_id"]) == ("-3.5", "true", "")


async def test_13_18_a_csv_for_a_reader_is_one_that_her_excel_opens(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(decision_record(distance_m=1.43))
    asked = {"format": "csv", "language": "es", "since": "2023-11-14T00:00:00Z"}

    answer = await client.get("/api/v1/decisions", params=asked)

    assert answer.content.startswith(b"\xef\xbb\xbf")
    name = answer.headers["content-disposition"]
    assert "decisions-2023-11-14.csv" in name
    [row] = csv.DictReader(
        io.StringIO(answer.content.decode("utf-8-sig")), delimiter=";"
    )
    assert row["distance_m"] == "1,43"
    assert row["started_at"] == "2023-11-14T22:13:20.000Z"
    assert "50\u00a0%" in row["qué pasó"]


async def test_13_18_programs_get_what_they_got(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(log_record())

    plain = await client.get("/api/v1/log", params={"format": "csv"})
    english = await client.get(
        "/api/v1/log", params={"format": "csv", "language": "en"}
    )

    assert plain.text.startswith("id,at,kind")
    assert "what happened,id,at,kind" in english.text


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t"])
async def test_a_spreadsheet_runs_nothing_from_a_csv(
    client: httpx.AsyncClient, past: Past, start: str
) -> None:
    past.holds(alert_record(note=f"{start}cmd()"))

    answer = await client.get("/api/v1/alerts", params={"format": "csv"})

    [row] = csv.DictReader(io.StringIO(answer.text))
    assert row["note"] == f"'{start}cmd()"


async def test_ndjson_holds_the_items_of_the_list_one_a_line(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(log_record(id=1), log_record(id=2, at=NOON + 1))
    headers = {"Accept": "text/csv;q=0.5, application/x-ndjson"}

    answer = await client.get("/api/v1/log", headers=headers)
    listed = (await client.get("/api/v1/log")).json()["items"]

    assert answer.headers["content-type"].startswith("application/x-ndjson")
    assert [orjson.loads(line) for line in answer.text.splitlines()] == listed


async def test_an_export_runs_through_every_page(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(*(log_record(id=n, at=NOON + n) for n in range(2345)))

    everything = await client.get("/api/v1/log", params={"format": "ndjson"})
    some = await client.get("/api/v1/log", params={"format": "ndjson", "limit": 7})

    ids = [orjson.loads(line)["id"] for line in everything.text.splitlines()]
    assert ids == list(range(2345))[::-1]
    assert len(some.text.splitlines()) == 7


async def test_parquet_is_the_whole_list_or_a_problem_without_its_library(
    client: httpx.AsyncClient, past: Past, monkeypatch: pytest.MonkeyPatch
) -> None:
    past.holds(*(log_record(id=n, at=NOON + n) for n in range(2345)))

    answer = await client.get("/api/v1/log", params={"format": "parquet"})

    assert answer.headers["Content-Type"] == "application/vnd.apache.parquet"
    table = parquet.read_table(io.BytesIO(answer.content))
    assert table.column("id").to_pylist() == list(range(2345))[::-1]

    monkeypatch.setitem(sys.modules, "pyarrow", None)
    refused = await client.get("/api/v1/log", params={"format": "parquet"})
    assert refused.status_code == 501
    assert "iveg[parquet]" in refused.json()["detail"]


async def test_the_dictionary_tells_each_column_of_each_list(
    client: httpx.AsyncClient,
) -> None:
    items = (await client.get("/api/v1/exports/dictionary")).json()["items"]

    assert {one["list"] for one in items} == {*LISTS, "audit"}
    (told,) = (
        one for one in items if (one["list"], one["column"]) == ("odometry", "linear")
    )
    assert (told["unit"], told["frame"], told["type"]) == ("m/s", "base_link", "number")


@pytest.mark.parametrize(
    "accept", ["*/*", "text/html", "application/json, text/csv;q=0.9", "text/csv;q=x"]
)
async def test_whoever_does_not_ask_for_a_file_gets_json(
    client: httpx.AsyncClient, accept: str
) -> None:
    answer = await client.get("/api/v1/log", headers={"Accept": accept})

    assert answer.headers["content-type"] == "application/json"


async def test_charts_show_the_last_quarter_of_an_hour(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(
        odometry_record(at=NOON - 3600.0),
        odometry_record(at=NOON, linear=0.9),
        odometry_record(at=NOON + 1, linear=0.4, limit_factor=0.5),
        odometry_record(at=NOON + 31, linear=0.0, limit_factor=0.5),
        detection_record(probability=0.81),
        command_record(standstill_ms=412.0),
    )

    figures = (await client.get("/api/v1/history/charts")).json()

    speed, limit = figures["speed"]["data"]
    assert speed["meta"] == {"kind": "speed", "robot": "AGI", "slice_s": 0.0}
    assert speed["y"] == [0.9, 0.4, None, 0.0]
    assert speed["x"][0] == 1000.0 * NOON
    assert limit["y"] == [1.0, 0.5, None, 0.5]
    assert limit["line"]["shape"] == "hv"
    [farmer] = figures["detections"]["data"]
    assert (farmer["name"], farmer["x"], farmer["y"]) == ("farmer", [0.825], [1])
    assert figures["detections"]["layout"]["shapes"][0]["x0"] == 0.8
    [standing] = figures["stops"]["data"]
    assert (standing["name"], standing["y"]) == ("standstill", [412.0])


async def test_charts_of_nothing_are_empty_figures(client: httpx.AsyncClient) -> None:
    figures = (await client.get("/api/v1/history/charts?robot=AGI")).json()

    names = ("speed", "margin", "detections", "stops")
    assert [figures[name]["data"] for name in names] == [[], [], [], []]


async def test_the_air_of_a_day_is_readings_and_figures(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(
        climate_record(at=NOON - 86_400.0),
        climate_record(at=NOON - 3600.0, temperature=16.25, co2=None),
        climate_record(at=NOON, co2=None),
    )

    air = (await client.get("/api/v1/history/climate")).json()

    assert [item["temperature"] for item in air["items"]] == [16.25, 21.5]
    assert air["items"][1]["at"] == "2023-11-14T22:13:20.000Z"
    assert (air["until"], air["slice_s"]) == ("2023-11-14T22:14:20.000Z", 0.0)
    # The line breaks between readings that are an hour apart.
    [warmth] = air["figures"]["temperature"]["data"]
    assert warmth["y"] == [16.25, None, 21.5]
    [humidity] = air["figures"]["humidity"]["data"]
    assert humidity["y"] == [70.0, None, 70.0]
    assert air["figures"]["co2"]["data"] == []


async def test_the_air_of_no_robot_can_be_asked_for(client: httpx.AsyncClient) -> None:
    answer = await client.get("/api/v1/history/climate?robot=AGI")

    assert answer.status_code == 422


async def test_the_library_names_the_sheets_that_a_strict_page_refuses(
    client: httpx.AsyncClient,
) -> None:
    air = (await client.get("/api/v1/history/climate")).json()
    script = gzip.decompress(plotly_library.library().packed)

    assert "plotly.js-style-global" in air["style_ids"]
    made = script.count(b'createElement("style")')
    # One place makes those of Plotly itself, each other place its own.
    assert len(air["style_ids"]) == made


@pytest.mark.parametrize(
    "query",
    [
        "since=2023-01-01T00:00:00Z&until=2023-02-02T00:00:00Z",
        "since=2023-11-14T23:00:00Z",
        "robot=*",
        "limit=5",
    ],
)
async def test_a_range_that_cannot_be_drawn_is_refused(
    client: httpx.AsyncClient, query: str
) -> None:
    answer = await client.get(f"/api/v1/history/charts?{query}")

    assert answer.status_code == 422


async def test_the_page_gets_plotly_from_this_server_and_keeps_it(
    client: httpx.AsyncClient,
) -> None:
    address = (await client.get("/api/v1/history/charts")).json()["library"]

    async with client.stream("GET", address) as answer:
        raw = b"".join([part async for part in answer.aiter_raw()])

    assert b"plotly.js (basic" in gzip.decompress(raw)[:100]
    assert answer.headers["content-type"].startswith("text/javascript")
    assert "immutable" in answer.headers["cache-control"]
    other = await client.get("/vendor/plotly-0.min.js")
    assert other.status_code == 404


def test_the_browser_draws_with_the_version_that_checks_the_figures() -> None:
    drawing = gzip.decompress(plotly_library.library().packed)
    package = importlib.resources.files("plotly") / "package_data" / "plotly.min.js"
    checking = package.read_bytes()

    assert _version(drawing) == _version(checking)


def _version(script: bytes) -> str:
    found = re.search(rb"v(\d+\.\d+\.\d+)", script[:100])
    assert found is not None
    return found[1].decode()


async def test_a_database_that_is_away_is_a_problem_and_not_a_crash(
    tmp_path: Path,
) -> None:
    app = FastAPI()
    queries = Queries("postgresql://somebody:secret@127.0.0.1:1/history")
    app.dependency_overrides[require("read")] = lambda: None
    app.include_router(router(queries, FakeWorker()))
    problems.install(app)
    transport = httpx.ASGITransport(app=app)

    async with httpx.AsyncClient(transport=transport, base_url="http://iveg") as client:
        answer = await client.get("/api/v1/log", params={"format": "csv"})

    queries.close()
    assert answer.status_code == 503
    assert "secret" not in answer.text


async def test_a_day_of_other_equipment_is_a_figure_of_each_attribute(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(
        measurement_record(at=NOON - 3600.0, attribute="flow", value=18.0),
        measurement_record(at=NOON, attribute="flow", value=19.0),
        measurement_record(at=NOON, attribute="ec", value=2.4),
    )

    exact = (
        await client.get("/api/v1/history/equipment?since=2023-11-14T21:00:00Z")
    ).json()
    means = (await client.get("/api/v1/history/equipment")).json()

    assert set(exact["figures"]) == set(means["figures"]) == {"unit/flow", "unit/ec"}
    for day in (exact, means):
        [trace] = day["figures"]["unit/flow"]["data"]
        # The line breaks between readings that are an hour apart.
        assert trace["y"] == [18.0, None, 19.0]


async def test_numbers_of_other_equipment_are_asked_for_by_entity_or_attribute(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(
        measurement_record(attribute="flow", value=18.0),
        measurement_record(attribute="ec", value=2.4),
    )

    for asked, values in (("unit", {18.0, 2.4}), ("flow", {18.0}), ("other", set())):
        items = (await client.get(f"/api/v1/measurements?class={asked}")).json()[
            "items"
        ]
        assert {one["value"] for one in items} == values
    assert (await client.get("/api/v1/measurements?robot=AGI")).status_code == 200


async def test_each_column_of_what_was_measured_is_a_key_of_its_json(
    client: httpx.AsyncClient, past: Past
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
        assert row == {name: exports.cell(name, item[name]) for name in row}


def _stamped(one: dict[str, object]) -> dict[str, object]:
    """An object of JSON inside a cell, its times as JSON has them."""
    return {
        key: format_stamp(value) if isinstance(value, float) else value
        for key, value in one.items()
    }


async def test_each_column_of_what_was_decided_is_a_key_of_its_json(
    client: httpx.AsyncClient, past: Past
) -> None:
    goal = {"kind": "aisle", "x": 1.0, "y": 2.0, "aisle": "3"}
    occurrence = {
        "priority": "P1",
        "raised_at": NOON,
        "cleared_at": NOON + 1.5,
        "acknowledged_at": None,
        "acknowledged_by": None,
        "note": None,
        "told": [],
    }
    sent, answered = (
        {"direct": NOON + 0.1, "fiware": NOON + 0.2},
        {"direct": NOON + 0.3},
    )
    past.holds(
        decision_record(),
        command_record(
            pressed_at=NOON - 0.1, sent_at=sent, answer_at=answered, goal=goal
        ),
        alert_record(members=[occurrence]),
        log_record(),
    )

    for path in ("decisions", "commands", "alerts", "log"):
        [item] = (await client.get(f"/api/v1/{path}")).json()["items"]
        lines = (await client.get(f"/api/v1/{path}?format=csv")).text
        [row] = csv.DictReader(io.StringIO(lines))
        told = {name: exports.cell(name, item[name]) for name in row}
        for name in {"links", "members"} & set(row):
            # JSON inside a cell keeps Unix seconds for one version more.
            kept, shown = orjson.loads(row.pop(name)), orjson.loads(told.pop(name))
            assert kept
            assert [_stamped(one) for one in kept] == shown
        assert row == told


async def test_a_track_is_what_was_seen_of_one_person(
    client: httpx.AsyncClient, past: Past
) -> None:
    past.holds(
        detection_record(at=NOON, person_id="P1-5f0c9a12"),
        detection_record(at=NOON + 1.0, person_id="P2-5f0c9a12"),
        detection_record(at=NOON + 2.0, person_id=None),
    )

    every = (await client.get("/api/v1/tracks")).json()["items"]
    one = (await client.get("/api/v1/tracks?person=P1-5f0c9a12")).json()["items"]

    assert [row["person_id"] for row in every] == ["P2-5f0c9a12", "P1-5f0c9a12"]
    assert [row["person_id"] for row in one] == ["P1-5f0c9a12"]


async def test_the_lists_are_described_for_integrators(past: Past) -> None:
    described = past.app.openapi()

    answer = described["paths"]["/api/v1/detections"]["get"]["responses"]["200"]
    assert set(answer["content"]) == {
        "application/json",
        "text/csv",
        "application/x-ndjson",
        "application/vnd.apache.parquet",
    }
    fields = described["components"]["schemas"]["DetectionRow"]["properties"]
    assert {"class", "position", "transport"} <= set(fields)


async def test_a_reading_reads_as_it_was_said(
    client: httpx.AsyncClient, past: Past
) -> None:
    value = {"percentage": 0.42, "charging": False, "voltage": None}
    past.holds(
        ReadingRecord(at=NOON, robot_id="AGI", kind="battery", value=value),
        ReadingRecord(at=NOON, robot_id="AGI", kind="rain", value={}),
    )

    told = await client.get("/api/v1/readings?class=battery&robot=AGI")
    lines = await client.get("/api/v1/readings?format=csv")

    assert told.json()["items"] == [
        {
            "at": "2023-11-14T22:13:20.000Z",
            "robot_id": "AGI",
            "kind": "battery",
            "value": value,
        }
    ]
    csv_value = '"{""percentage"":0.42,""charging"":false,""voltage"":null}"'
    assert lines.text.splitlines()[-1].endswith(csv_value)
