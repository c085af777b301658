"""Incident packs over HTTP: what is in one, and what it never holds."""

import io
import zipfile
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import orjson
import pytest
from fastapi import FastAPI
from mcap.reader import make_reader

from iveg.adapters.history.queries import Queries
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from iveg.domain.stamps import format_stamp
from iveg.settings import Settings
from iveg.web import problems
from iveg.web.api import alerts
from iveg.web.api.incidents import Sources, router
from iveg.web.security.requirements import require
from iveg.web.security.roles import Principal
from tests.databases import remember
from tests.fakes.clock import FakeClock
from tests.fakes.recordings import input_recorder
from tests.fakes.records import (
    NOON,
    alert_record,
    command_record,
    decision_record,
    log_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker

SECRET = "5ec2e7" * 8
ODOM = "/iveg/AGI_odom/attrs"
SINCE, UNTIL = "2023-11-14T22:13:30Z", "2023-11-14T22:14:00Z"


class Desk:
    """A history and a recording of two minutes about noon."""

    def __init__(self, folder: Path) -> None:
        self.url = f"sqlite:///{folder / 'history.db'}"
        remember(self.url)
        self.queries = Queries(self.url)
        self.recorder = input_recorder(folder / "recordings", FakeClock())
        self.lines: list[LogEvent] = []
        now = FakeClock()
        now.now = 3600.0
        settings = {"IVEG_API_TOKEN": SECRET, "IVEG_MQTT_URL": "mqtt://ana:pw@host:1"}
        self.app = FastAPI()
        self.app.dependency_overrides[require("release")] = lambda: Principal(
            "ana", "operator"
        )
        self.sources = Sources(
            self.queries,
            self.recorder,
            FakeWorker(),
            lambda: [DetectionRule()],
            Settings.from_environment(settings).without_secrets(),
            lambda event, _: self.lines.append(event),
            now,
            "1.0",
        )
        self.app.include_router(router(self.sources))
        self.app.dependency_overrides[require("read")] = lambda: None
        self.clock = FakeClock()
        self.app.include_router(alerts.notes_router(self.queries, self.log, self.clock))
        problems.install(self.app)

    async def fill(self) -> None:
        started = NOON + 60.0
        rows: tuple[Record, ...] = (
            decision_record(started_at=started, ended_at=started + 5.0),
            command_record(requested_at=started + 1.0),
            alert_record(last_raised_at=started, cleared_at=started + 2.0),
            *(log_record(id=n, at=NOON + n, key="log.start") for n in (1, 45, 119)),
            *(odometry_record(at=NOON + n) for n in range(120)),
        )
        remember(self.url, *rows)
        for n in range(1200):
            at = Instant(1000.0 + n / 10, NOON + n / 10)
            self.recorder.measure(ODOM, b'{"n":%d}' % n, at)
        await self.recorder.write()

    def log(self, event: LogEvent, at: Instant) -> None:
        """A line of the log, in the history at once."""
        row = log_record(
            id=10_000, at=at.wall, key=event.key, slots=event.slots, class_=None
        )
        remember(self.url, row)


@pytest.fixture
async def desk(tmp_path: Path) -> AsyncIterator[Desk]:
    desk = Desk(tmp_path)
    await desk.fill()
    yield desk
    await desk.recorder.close()
    desk.queries.close()


def client_of(desk: Desk) -> httpx.AsyncClient:
    transport = httpx.ASGITransport(app=desk.app)
    return httpx.AsyncClient(
        transport=transport, base_url="http://iveg", headers={"accept-language": "en"}
    )


async def ask(desk: Desk, **asked: str) -> httpx.Response:
    async with client_of(desk) as client:
        return await client.get("/api/v1/incident", params=asked)


async def pack(desk: Desk, **asked: str) -> dict[str, bytes]:
    """Its files, by name."""
    answer = await ask(desk, **asked)
    assert answer.status_code == 200, answer.text
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        return {name: whole.read(name) for name in whole.namelist()}


async def test_a_decisions_pack_holds_its_minutes_and_no_secret(desk: Desk) -> None:
    files = await pack(desk, decision=decision_record().decision_id)

    assert [one.key for one in desk.lines] == ["log.incident_packed"]
    odometry = files["rows/odometry.ndjson"].splitlines()
    assert [orjson.loads(one)["at"] - NOON for one in odometry] == [*range(30, 95)]
    assert len(files["rows/log.ndjson"].splitlines()) == 1
    recorded = make_reader(io.BytesIO(files["recording.mcap"]))
    numbers = [orjson.loads(m.data)["n"] for _, _, m in recorded.iter_messages()]
    assert numbers == [*range(300, 950)]
    assert b"<script" not in files["report.html"]
    everything = b"".join(files.values())
    assert SECRET.encode() not in everything
    assert b"ana:pw" not in everything


async def test_a_range_has_its_very_ends(desk: Desk) -> None:
    files = await pack(desk, since=SINCE, until=UNTIL)

    assert len(files["rows/odometry.ndjson"].splitlines()) == 30
    told = orjson.loads(files["about.json"])
    assert told["since"].startswith("2023-11-14T22:13:30")
    assert told["messages"] == 300


@pytest.mark.parametrize(
    ("asked", "status"),
    [
        # An hour at most.
        ({"since": SINCE, "until": "2023-11-14T23:13:31Z"}, 422),
        ({"since": SINCE}, 422),
        ({"decision": "none"}, 404),
        ({"command": "none"}, 404),
    ],
)
async def test_what_cannot_be_packed_is_refused(
    desk: Desk, asked: dict[str, str], status: int
) -> None:
    assert (await ask(desk, **asked)).status_code == status


async def test_a_pack_does_not_claim_what_is_still_to_come(desk: Desk) -> None:
    now = desk.sources.clock().wall
    until = format_stamp(now + 30.0)
    files = await pack(desk, since=format_stamp(now - 60.0), until=until)
    later = await ask(desk, since=format_stamp(now + 10.0), until=until)

    assert orjson.loads(files["about.json"])["until"] == format_stamp(now)
    assert until.encode() not in files["report.html"]
    assert later.status_code == 422


async def test_an_alerts_pack_has_what_people_noted_about_its_minutes(
    desk: Desk,
) -> None:
    desk.clock.now = 3600.0
    about = {"at": "2023-11-14T22:14:21Z", "text": "<b>Ana</b> crossed", "x": 1, "y": 2}
    async with client_of(desk) as client:
        written = await client.post("/api/v1/notes", json=about)
        assert written.status_code == 201, written.text
        (note,) = (await client.get("/api/v1/notes")).json()["items"]
    assert (note["by"], note["text"]) == ("ana", "<b>Ana</b> crossed")
    assert note["at"] == "2023-11-14T22:14:21.000Z"
    assert note["written_at"] == "2023-11-14T23:13:20.000Z"
    assert (note["x"], note["y"]) == (1.0, 2.0)

    files = await pack(desk, alert=alert_record().alert_id)
    (kept,) = files["rows/notes.ndjson"].splitlines()
    page = files["report.html"].decode()
    assert orjson.loads(kept)["slots"]["pinned_at"] == NOON + 61.0
    assert page.count("&lt;b&gt;Ana&lt;/b&gt; crossed") == 1
    assert "23:14:21.000" in page

    early = await pack(desk, since="2023-11-14T22:13:20Z", until="2023-11-14T22:14:21Z")
    assert early["rows/notes.ndjson"] == b""
