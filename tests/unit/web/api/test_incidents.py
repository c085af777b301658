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
from iveg.cli import COMMANDS, incident
from iveg.cli.arguments import CommandCall, parser
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.events import LogEvent
from iveg.domain.observations import Instant
from iveg.domain.records import Record
from iveg.domain.stamps import format_stamp
from iveg.pipeline.record import Waiting
from iveg.settings import Settings
from iveg.web import problems
from iveg.web.api import notes
from iveg.web.api.incidents import Sources, router
from iveg.web.security.requirements import require
from iveg.web.security.roles import Principal
from tests.databases import lay_history
from tests.fakes.clock import FakeClock
from tests.fakes.recordings import WriterInPlace
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
PRINTER = """#!/bin/sh
for word in "$@"; do
  case "$word" in
    --print-to-pdf=*) pdf="${{word#--print-to-pdf=}}" ;;
    file://*) page="${{word#file://}}" ;;
  esac
done
{work}
"""


class Desk:
    """A history and a recording of two minutes about noon."""

    def __init__(self, folder: Path, browser: str | None = None) -> None:
        url = f"sqlite:///{folder / 'history.db'}"
        lay_history(url)
        self.store, self.queries = Store(url), Queries(url)
        setup = WriterSetup(folder / "recordings")
        self.recorder = InputRecorder(setup, FakeClock())
        self.in_place = WriterInPlace(setup)
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
            browser,
        )
        self.app.include_router(router(self.sources))
        self.app.dependency_overrides[require("read")] = lambda: None
        self.clock = FakeClock()
        self.app.include_router(
            notes.router(self.queries, ["R1"], self.log, self.clock)
        )
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
        self.store.write([Waiting(one, n, 0.0) for n, one in enumerate(rows, 1)])
        for n in range(1200):
            at = Instant(1000.0 + n / 10, NOON + n / 10)
            self.recorder.measure(ODOM, b'{"n":%d}' % n, at)
        self.in_place.write(self.recorder, 1120.0)

    def log(self, event: LogEvent, at: Instant) -> None:
        """A line of the log, in the history at once."""
        row = log_record(
            id=10_000, at=at.wall, key=event.key, slots=event.slots, class_=None
        )
        self.store.write([Waiting(row, 1, 0.0)])

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


def client_of(desk: Desk) -> httpx.AsyncClient:
    transport = httpx.ASGITransport(app=desk.app)
    return httpx.AsyncClient(transport=transport, base_url="http://iveg")


async def ask(desk: Desk, **asked: str) -> httpx.Response:
    async with client_of(desk) as client:
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
    assert incident.run(CommandCall(options, Settings(), {}, pack.parent)) == 0
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
    assert (await ask(desk, alert="none")).status_code == 404
    assert (await ask(desk, since=until, until=since)).status_code == 422


async def test_a_pack_does_not_claim_what_is_still_to_come(desk: Desk) -> None:
    now = desk.sources.clock().wall
    until = format_stamp(now + 30.0)
    answer = await ask(desk, since=format_stamp(now - 60.0), until=until)
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        told = orjson.loads(whole.read("manifest.json"))
        assert told["until"] == format_stamp(now)
        assert until.encode() not in whole.read("report.en.html")

    later = await ask(desk, since=format_stamp(now + 10.0), until=until)
    assert later.status_code == 422
    assert "still to come" in later.json()["detail"]


async def test_the_page_of_a_pack_names_the_zone_of_its_times(desk: Desk) -> None:
    since, until = "2023-11-14T22:13:30Z", "2023-11-14T22:14:00Z"
    answer = await ask(desk, since=since, until=until)
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        page = whole.read("report.en.html").decode()
    assert "2023-11-14 23:13:30 – 2023-11-14 23:14:00" in page
    assert "Europe/Madrid" in page


async def test_a_pack_of_a_time_without_rows_says_so(desk: Desk) -> None:
    answer = await ask(desk, since="2020-01-01T00:00:00Z", until="2020-01-01T00:05:00Z")
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        assert b"Nothing was recorded" in whole.read("report.en.html")


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

    answer = await ask(desk, alert=alert_record().alert_id)
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        (kept,) = whole.read("rows/notes.ndjson").splitlines()
        page = whole.read("report.en.html").decode()
        names = whole.namelist()
    assert orjson.loads(kept)["slots"]["pinned_at"] == NOON + 61.0
    assert page.count("&lt;b&gt;Ana&lt;/b&gt; crossed") == 1
    assert "23:14:21.000" in page
    assert not [name for name in names if name.endswith(".pdf")]

    early = await ask(desk, since="2023-11-14T22:13:20Z", until="2023-11-14T22:14:21Z")
    with zipfile.ZipFile(io.BytesIO(early.content)) as whole:
        assert whole.read("rows/notes.ndjson") == b""


@pytest.mark.parametrize(
    "wrong",
    [
        {"text": ""},
        {"text": "  "},
        {"text": "a\u0000b"},
        {"text": "a" * 1001},
        {"text": "a", "x": 1.0},
        {"text": "a", "x": "1e9", "y": 0},
        {"text": "a", "at": "2023-11-14T22:13:21Z"},
        {"text": "a", "at": "2020-11-14T22:13:21Z"},
        {"text": "a", "place": "here"},
    ],
)
async def test_a_note_that_is_none_is_refused(
    desk: Desk, wrong: dict[str, object]
) -> None:
    async with client_of(desk) as client:
        assert (await client.post("/api/v1/notes", json=wrong)).status_code == 422


async def test_a_note_is_about_a_robot_of_the_fleet_or_of_a_record(desk: Desk) -> None:
    answers = []
    async with client_of(desk) as client:
        for robot in ("R1", alert_record().slots["robot"], "R9"):
            body = {"text": "a", "robot_id": robot}
            answers.append(await client.post("/api/v1/notes", json=body))

    assert [one.status_code for one in answers] == [201, 201, 404]
    assert answers[-1].json()["type"].endswith("unknown-robot")


@pytest.mark.parametrize("prints", [True, False])
async def test_the_page_is_a_pdf_too_where_a_browser_makes_one(
    tmp_path: Path, *, prints: bool
) -> None:
    browser = tmp_path / "chromium"
    work = 'cp "$page" "$pdf"' if prints else "exit 1"
    browser.write_text(PRINTER.format(work=work))
    browser.chmod(0o755)
    desk = Desk(tmp_path, str(browser))
    await desk.fill()
    answer = await ask(desk, decision=decision_record().decision_id)
    await desk.close()
    with zipfile.ZipFile(io.BytesIO(answer.content)) as whole:
        found = {name for name in whole.namelist() if name.startswith("report")}
        page, pdf = "report.es.html", "report.es.pdf"
        assert page in found
        assert (pdf in found) is prints
        if prints:
            assert whole.read(pdf) == whole.read(page)
