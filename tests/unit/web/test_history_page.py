"""The History page in a browser, under the policy that it is really sent with."""

import re
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Thread

import pytest
import uvicorn
from fastapi import FastAPI, WebSocket
from playwright.sync_api import Browser, Page, expect
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocketDisconnect

import iveg
from iveg.adapters.history.queries import Queries
from iveg.adapters.history.store import Store
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.records import Record
from iveg.pipeline.record import Waiting
from iveg.web import problems
from iveg.web.api import history
from iveg.web.live.pacing import SUBPROTOCOL
from iveg.web.pages import service_worker
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.pages.openapi import describe_api
from iveg.web.pages.routes import router
from iveg.web.security.authentication import Authenticator
from iveg.web.security.headers import SecurityHeaders
from iveg.web.security.requirements import require
from iveg.web.security.roles import Principal
from tests.browsers import running_browser
from tests.builders import START
from tests.databases import lay_history
from tests.fakes.records import (
    command_record,
    decision_record,
    detection_record,
    odometry_record,
)
from tests.fakes.worker import FakeWorker

pytestmark = pytest.mark.e2e

_SITE = Site(
    greenhouse="mvsim-20x20",
    robots=("AGI", "AGII"),
    version="0",
    demo=False,
)


class Server:
    """The page, its files and its API, over a database that can go away."""

    def __init__(self, directory: Path) -> None:
        url = f"sqlite:///{directory / 'history.db'}"
        self.file = directory / "history.db"
        lay_history(url)
        self._store = Store(url)
        self._queries = Queries(f"{url}?timeout=0.1")
        config = uvicorn.Config(self._app(), port=0, log_level="warning")
        self._server = uvicorn.Server(config)
        self._thread = Thread(target=self._server.run, name="history-page")

    def _app(self) -> SecurityHeaders:
        app = FastAPI(docs_url=None)
        app.state.authenticator = Authenticator(
            sign_in_token="cd" * 32, api_token="", clock=lambda: START
        )
        reader = Principal("ana", "operator")
        app.dependency_overrides[require("read")] = lambda: reader
        app.include_router(service_worker.router())
        app.include_router(history.router(self._queries, FakeWorker()))
        app.include_router(
            router(
                Pages(_SITE),
                document=lambda: describe_api(app),
                rule=DetectionRule,
            )
        )
        app.add_api_route("/healthz", lambda: "ok")
        app.add_api_websocket_route("/live", _say_nothing)
        app.mount(
            "/static", StaticFiles(directory=Path(iveg.__file__).parent / "static")
        )
        problems.install(app)
        return SecurityHeaders(app)

    def holds(self, *records: Record) -> None:
        rows = [Waiting(record, n, 0.0) for n, record in enumerate(records, 1)]
        self._store.write(rows)

    def __enter__(self) -> "Server":
        self.holds()
        self._thread.start()
        deadline = time.monotonic() + 30.0
        while not self._server.started:
            assert time.monotonic() < deadline, "the server did not start"
            self._thread.join(0.02)
        return self

    def __exit__(self, *_: object) -> None:
        self._server.should_exit = True
        self._server.force_exit = True
        self._thread.join()
        self._queries.close()
        self._store.close()

    @property
    def address(self) -> str:
        host, port = self._server.servers[0].sockets[0].getsockname()
        return f"http://{host}:{port}/history"


async def _say_nothing(websocket: WebSocket) -> None:
    await websocket.accept(SUBPROTOCOL)
    try:
        while True:
            await websocket.receive_text()
    except WebSocketDisconnect:
        return


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as found:
        yield found


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    with Server(tmp_path) as running:
        yield running


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context(
        locale="es-ES", viewport={"width": 1280, "height": 900}
    )
    yield context.new_page()
    context.close()


def past(now: float) -> tuple[Record, ...]:
    """Five minutes of one robot, a person, and a STOP."""
    driving = (odometry_record(at=now - 300 + n, linear=0.8) for n in range(200))
    seen = (detection_record(at=now - n) for n in range(1, 20))
    slowed = (
        decision_record(
            decision_id=f"D{n:02}", started_at=now - n, ended_at=now - n + 7
        )
        for n in range(10, 35)
    )
    stopped = command_record(
        requested_at=now - 100, state="STANDING", standstill_ms=412.0
    )
    return (*driving, *seen, *slowed, stopped)


def test_a_quarter_of_an_hour_is_drawn_without_a_complaint_of_the_policy(
    server: Server, page: Page
) -> None:
    complaints: list[str] = []
    page.on("console", lambda m: complaints.append(f"{m.type}: {m.text}"))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    server.holds(*past(time.time()))

    page.goto(server.address)

    expect(page.locator("#chart-speed .scatterlayer path.js-line")).to_have_count(2)
    expect(page.locator("#chart-detections .bars path")).to_have_count(1)
    expect(page.locator("#chart-stops .points path")).to_have_count(1)
    expect(page.locator("#rows-commands tbody")).to_contain_text("412")
    expect(page.locator("#history")).not_to_have_attribute("data-busy", "")
    assert complaints == []


def test_more_rows_come_when_asked_for(server: Server, page: Page) -> None:
    server.holds(*past(time.time()))
    page.goto(server.address)
    rows = page.locator("#rows-decisions tbody tr")
    expect(rows).to_have_count(20)

    page.click("#rows-decisions-more")

    expect(rows).to_have_count(25)
    expect(page.locator("#rows-decisions-more")).to_be_hidden()


def test_a_decision_opens_its_chain_and_escape_gives_the_focus_back(
    server: Server, page: Page
) -> None:
    server.holds(*past(time.time()))
    page.goto(server.address)

    page.click("#rows-decisions [data-decision=D10]")
    expect(page.locator("#decision .chain li")).to_have_count(1)
    page.keyboard.press("Escape")

    expect(page.locator("#decision-panel")).to_be_hidden()
    expect(page.locator("[data-decision=D10]")).to_be_focused()


def test_a_robot_and_a_range_stay_in_the_address_and_in_the_downloads(
    server: Server, page: Page
) -> None:
    page.goto(server.address)

    page.click("[data-range='1h']")
    page.click(".chip[data-robot=AGII]")
    page.reload()

    expect(page.locator("[data-range='1h']")).to_have_attribute("aria-pressed", "true")
    expect(page.locator(".chip[data-robot=AGII]")).to_have_attribute(
        "aria-pressed", "true"
    )
    download = page.locator("[data-export=log][data-format=csv]")
    expect(download).to_have_attribute("href", _matching("robot=AGII&format=csv"))


def test_a_range_of_ones_own_is_on_the_greenhouses_clock(
    server: Server, page: Page
) -> None:
    page.goto(
        f"{server.address}?range=own&since=2026-07-01T12:00:00&until=2026-07-01T13:00:00"
    )

    download = page.locator("[data-export=log][data-format=csv]")
    expect(download).to_have_attribute("href", _matching("since=2026-07-01T10%3A00"))
    expect(page.locator("#history-range")).to_contain_text("01/07/2026 12:00:00")


def test_a_range_turned_round_is_told_and_nothing_is_asked(
    server: Server, page: Page
) -> None:
    page.goto(
        f"{server.address}?range=own&since=2026-07-01T12:00:00&until=2026-07-01T11:00:00"
    )

    expect(page.locator("#history-error")).to_contain_text("«Desde»")


def test_nothing_in_a_range_is_said_and_not_drawn(server: Server, page: Page) -> None:
    page.goto(server.address)

    for name in ("chart-speed", "chart-detections", "chart-stops", "rows-decisions"):
        expect(page.locator(f"#{name}-empty")).to_be_visible()
        expect(page.locator(f"#{name}")).to_be_hidden()


def test_a_database_that_is_away_is_told_in_the_readers_language(
    server: Server, page: Page
) -> None:
    server.file.rename(server.file.with_suffix(".gone"))
    server.file.mkdir()

    page.goto(server.address)
    expect(page.locator("#history-error")).to_contain_text("base de datos no responde")
    page.click("[data-language=en]")

    expect(page.locator("#history-error")).to_contain_text("database does not answer")


def test_no_robot_id_from_the_address_is_trusted(server: Server, page: Page) -> None:
    page.goto(f"{server.address}?robot=%3Cimg%20src%3Dx%3E&range=ever")

    expect(page.locator("[data-range='15m']")).to_have_attribute("aria-pressed", "true")
    expect(page.locator("[data-robot='']")).to_have_attribute("aria-pressed", "true")


def _matching(part: str) -> re.Pattern[str]:
    return re.compile(re.escape(part))
