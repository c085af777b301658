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
from iveg.adapters.history.store import Store
from iveg.adapters.incident_files import verify_pack
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.recordings.writer import WriterSetup
from iveg.cli import COMMANDS
from iveg.cli.arguments import parser
from iveg.cli.incident import run_incident
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from iveg.pipeline.record import Waiting
from iveg.settings import Settings
from iveg.web import problems
from iveg.web.api.incidents import Sources, router
from iveg.web.security.authentication import Principal, require
from tests.fakes.clock import FakeClock
from tests.fakes.recordings import WriterInPlace
from tests.fakes.records import (
    NOON,
    command_record,
    decision_record,
    log_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker

SECRET = "5ec2e7" * 8
ODOM = "/iveg/AGI_odom/attrs"


class Desk:
    """A history and a recording of two minutes about noon."""

    def __init__(self, folder: Path) -> None:
        url = f"sqlite:///{folder / 'history.db'}"
        self.store, self.queries = Store(url), Queries(url)
        setup = WriterSetup(folder / "recordings")
        self.recorder = InputRecorder(setup, FakeClock())
        self.in_place = WriterInPlace(setup)
        self.lines: list[LogEvent] = []
        settings = {"IVEG_API_TOKEN": SECRET, "IVEG_MQTT_URL": "mqtt://ana:pw@host:1"}
        self.app = FastAPI()
        self.app.dependency_overrides[require("release")] = lambda: Principal(
            "ana", "operator"
        )
        self.app.include_router(
            router(
                Sources(
                    self.queries,
                    self.recorder,
                    FakeWorker(),
                    lambda: [DetectionRule()],
                    Settings.from_environment(settings).told(),
                    lambda event, _: self.lines.append(event),
                    FakeClock(),
                    "1.0",
                )
            )
        )
        problems.install(self.app)

    async def fill(self) -> None:
        started = NOON + 60.0
        rows: tuple[Record, ...] = (
            decision_record(started_at=started, ended_at=started + 5.0),
            command_record(requested_at=started + 1.0),
            *(log_record(id=n, at=NOON + n, key="log.start") for n in (1, 45, 119)),
            *(odometry_record(at=NOON + n) for n in range(120)),
        )
        self.store.write([Waiting(one, n, 0.0) for n, one in enumerate(rows, 1)])
        for n in range(1200):
            at = Instant(1000.0 + n / 10, NOON + n / 10)
            self.recorder.measure(ODOM, b'{"n":%d}' % n, at, False)
        self.in_place.write(self.recorder, 1120.0)

    async def close(self) -> None:
        self.in_place.writer.finish()
        self.queries.close()
        self.store.close()


@pytest.fixture
async def desk(tmp_path: Path) -> AsyncIterator[Desk]:
    desk = Desk(tmp_path)
    await desk.fill()
    yield desk
    await desk.close()


async def ask(desk: Desk, **asked: str) -> httpx.Response:
    transport = httpx.ASGITransport(app=desk.app)
    async with httpx.AsyncClient(transport=transport, base_url="http://iveg") as client:
        return await client.get("/api/v1/incident", params=asked)


async def test_a_decisions_pack_holds_its_minutes_and_is_whole(
    desk: Desk, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = await ask(desk, decision=decision_record().decision_id)
    assert answer.status_code == 200, answer.text
    pack = tmp_path / "got.zip"
    pack.write_bytes(answer.content)

    end, wrong = verify_pack(pack)
    assert wrong == []
    assert [one.slots["chain"] for one in desk.lines] == [end]
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        odometry = whole.read("rows/odometry.ndjson").splitlines()
        assert [orjson.loads(one)["at"] - NOON for one in odometry] == [*range(30, 95)]
        assert len(whole.read("rows/log.ndjson").splitlines()) == 1
        recorded = make_reader(io.BytesIO(whole.read("recording.mcap")))
        numbers = [orjson.loads(m.data)["n"] for _, _, m in recorded.iter_messages()]
        assert numbers == [*range(300, 950)]
        for name in ("report.es.html", "report.en.html"):
            assert b"<script" not in whole.read(name)
        everything = b"".join(whole.read(name) for name in whole.namelist())
    assert SECRET.encode() not in everything
    assert b"ana:pw" not in everything

    options = parser(COMMANDS).parse_args(["incident", "verify", str(pack)])
    assert run_incident(options) == 0
    assert end in capsys.readouterr().out


async def test_a_range_has_its_very_ends_and_an_hour_at_most(desk: Desk) -> None:
    since, until = "2023-11-14T22:13:30Z", "2023-11-14T22:14:00Z"
    answer = await ask(desk, since=since, until=until)
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        assert len(whole.read("rows/odometry.ndjson").splitlines()) == 30
        told = orjson.loads(whole.read("manifest.json"))
    assert told["since"].startswith("2023-11-14T22:13:30")
    assert told["messages"] == 300

    long = await ask(desk, since=since, until="2023-11-14T23:13:31Z")
    assert long.status_code == 422
    assert (await ask(desk, since=since)).status_code == 422
    assert (await ask(desk, decision="none")).status_code == 404
    assert (await ask(desk, command="none")).status_code == 404
    assert (await ask(desk, since=until, until=since)).status_code == 422


async def test_a_pack_of_a_time_without_rows_says_so(desk: Desk) -> None:
    answer = await ask(desk, since="2020-01-01T00:00:00Z", until="2020-01-01T00:05:00Z")
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        assert b"Nothing was recorded" in whole.read("report.en.html")
