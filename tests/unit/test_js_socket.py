"""The browser's line to the server, against a server that goes away and comes back.

The sockets are real; the clock of the page runs on by itself, and a test moves it ahead
instead of waiting (``page.clock``).
"""

import json
from collections.abc import Iterator
from contextlib import suppress
from http import HTTPStatus
from pathlib import Path
from socket import SHUT_RDWR
from threading import Thread
from time import monotonic, time
from typing import Any

import pytest
from playwright.sync_api import Browser, Page
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve
from websockets.typing import Subprotocol

from iveg.web.live.feed import SUBPROTOCOL
from tests.browsers import running_browser
from tests.unit.test_js_modules import served

_ROOT = Path(__file__).parents[2]
_PATIENCE_MS = 30_000
"""Ends a test in which nothing comes any more; nothing is measured by it."""
_CONNECT = """async ([url]) => {
    const {snapshot} = await import('/tests/js/builders.js');
    const {LiveLine} = await import('/iveg/static/js/core/socket.js');
    const {Store} = await import('/iveg/static/js/core/store.js');
    const store = new Store();
    const sight = Object.assign(new EventTarget(), {hidden: false});
    const line = new LiveLine({url, store, page: sight});
    const states = [];
    store.subscribe('connection', (it) => states.push(it.state));
    Object.assign(window, {store, line, sight, states});
}"""


class LiveServer:
    """Speaks ``/live`` well enough for one browser, and fails when told to.

    Attributes:
        heard: What browsers sent, pings left out.
        answers: Whether pings are answered; without it the line falls silent.
        refusal: The code that new connections are closed with; None takes them.
    """

    def __init__(self) -> None:
        self.heard: list[dict[str, Any]] = []
        self.answers = True
        self.refusal: int | None = None
        self.attempts = 0
        self.clock_ahead_s = 0.0
        self._port = 0
        self._connections: list[ServerConnection] = []

    @property
    def url(self) -> str:
        """Where a browser connects to."""
        return f"ws://127.0.0.1:{self._port}/live"

    def start(self) -> None:
        """Listens, at the same address as before."""
        self._server: Server = serve(
            self._talk,
            "127.0.0.1",
            self._port,
            process_request=self._answer_health,
            subprotocols=[Subprotocol(SUBPROTOCOL)],
        )
        self._port = self._server.socket.getsockname()[1]
        self._thread = Thread(target=self._server.serve_forever, name="live")
        self._thread.start()

    def stop(self) -> None:
        """Goes away as a killed process does: every connection breaks at once."""
        self._server.shutdown()
        self._thread.join()
        for connection in self._connections:
            with suppress(OSError):
                connection.socket.shutdown(SHUT_RDWR)
        self._connections.clear()

    def tell(self, at: float, frame: int = 1) -> None:
        """A frame of telemetry: AGI moves; true at ``at`` (s), by the server's word."""
        move = ["AGI", at, 0.0, 1.0, 2.0, 0.0, 0.5, 0.0, "2026-11-20T09:00:00.000Z"]
        head = json.dumps({"frame": frame, "moves": [move]}).encode()
        head += b" " * (-len(head) % 4)
        for connection in self._connections:
            connection.send(len(head).to_bytes(4, "little") + head)

    def _talk(self, connection: ServerConnection) -> None:
        self.attempts += 1
        if self.refusal is not None:
            connection.close(self.refusal)
            return
        self._connections.append(connection)
        with suppress(ConnectionClosed):
            _send(connection, "snapshot", _SNAPSHOT)
            for text in connection:
                self._take(connection, json.loads(text))

    def _answer_health(
        self, connection: ServerConnection, request: Request
    ) -> Response | None:
        if request.path != "/healthz":
            return None
        return connection.respond(HTTPStatus.OK, "ok\n")

    def _take(self, connection: ServerConnection, said: dict[str, Any]) -> None:
        if said["type"] != "ping":
            self.heard.append(said)
        elif self.answers:
            now = time() + self.clock_ahead_s
            pong = {"t": said["t"], "server": now}
            frame = {"topic": "pong", "data": pong, "at": monotonic()}
            connection.send(json.dumps(frame))


_SNAPSHOT: dict[str, Any] = {
    "t": "2026-11-20T09:00:00.000Z",
    "map": None,
    "robots": [{"robot_id": "AGI", "age_s": 0.0}],
    "people": [],
    "detections": {},
    "commands": [],
    "alerts": [],
    "log": [],
}


def _send(connection: ServerConnection, topic: str, data: dict[str, Any]) -> None:
    connection.send(json.dumps({"topic": topic, "data": data}))


@pytest.fixture(scope="module")
def files() -> Iterator[str]:
    with served("ws: http:") as address:
        yield address


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with running_browser() as found:
        yield found


@pytest.fixture
def live() -> Iterator[LiveServer]:
    server = LiveServer()
    server.start()
    yield server
    server.stop()


@pytest.fixture
def page(browser: Browser, files: str, live: LiveServer) -> Iterator[Page]:
    """A page whose line is open."""
    opened = browser.new_page()
    opened.clock.install()
    opened.goto(files)
    opened.evaluate(_CONNECT, [live.url])
    # Told a frame after it is known: what is told from here on is news.
    opened.wait_for_function(
        "() => window.states.at(-1) === 'open'", timeout=_PATIENCE_MS
    )
    opened.evaluate("() => window.states.splice(0)")
    yield opened
    opened.close()


def _wait_for_state(page: Page, state: str, within_ms: float = _PATIENCE_MS) -> None:
    page.wait_for_function(
        "state => window.store.connection.state === state",
        arg=state,
        timeout=within_ms,
    )


def test_a_line_that_falls_silent_is_lost_within_three_seconds(
    page: Page, live: LiveServer
) -> None:
    live.answers = False

    page.clock.run_for(3000)

    # It may have found the server again since.
    assert "lost" in page.evaluate("() => window.states")


def test_a_page_seen_again_starts_from_a_fresh_snapshot_without_an_alert(
    page: Page, live: LiveServer
) -> None:
    page.evaluate(
        """() => {
            window.first = window.store.get('snapshot');
            window.show = (isShown) => {
              window.sight.hidden = !isShown;
              window.sight.dispatchEvent(new Event('visibilitychange'));
            };
        }"""
    )

    page.evaluate("() => window.show(false)")
    page.clock.run_for(1200)  # hidden for longer than a glance elsewhere
    page.evaluate("() => window.show(true)")

    page.wait_for_function("() => window.store.get('snapshot') !== window.first")
    assert page.evaluate("() => window.store.connection.state") == "open"
    assert "lost" not in page.evaluate("() => window.states")
    assert live.attempts == 2


def test_an_ended_session_is_told_and_not_tried_again(
    page: Page, live: LiveServer
) -> None:
    live.refusal = 4401
    live.stop()
    live.start()

    _wait_for_state(page, "signed-out")

    attempts = live.attempts
    page.clock.run_for(1500)  # several retries long
    page.evaluate("() => fetch('/')")  # and what they would have asked is out
    assert live.attempts == attempts


def test_a_stop_without_a_line_goes_out_when_the_line_is_back(
    page: Page, live: LiveServer
) -> None:
    live.stop()
    _wait_for_state(page, "lost")

    sent = page.evaluate("() => window.line.sendStop(null, 'press-2', 12.5)")
    live.start()

    page.wait_for_function("() => window.line.pressesWaiting() === 0")
    assert sent is False
    assert [(it["robot_id"], it["press_id"]) for it in live.heard] == [
        (None, "press-2")
    ]


def test_a_stop_that_a_dead_line_swallowed_is_sent_again(
    page: Page, live: LiveServer
) -> None:
    live.answers = False
    page.evaluate("() => window.line.sendStop(null, 'press-3', 12.5)")
    page.clock.run_for(3000)
    assert "lost" in page.evaluate("() => window.states")

    live.answers = True

    page.wait_for_function("() => window.line.pressesWaiting() === 0")
    assert {it["press_id"] for it in live.heard} == {"press-3"}
    assert len(live.heard) >= 2


# --- telemetry ----------------------------------------------------------------------


def test_what_was_long_on_its_way_is_late_although_the_server_says_it_is_fresh(
    page: Page, live: LiveServer
) -> None:
    page.evaluate(
        """async () => {
            const {linkOfRobot} = await import('/iveg/static/js/core/clock.js');
            window.links = [];
            window.store.watch((robot) => window.links.push(linkOfRobot(robot)));
        }"""
    )
    page.wait_for_function("() => window.line.roundTripMs() !== null")

    for age_s in (0.0, 1.5, 4.0):
        live.tell(monotonic() - age_s)
    page.wait_for_function("() => window.links.length === 3")

    assert page.evaluate("() => window.links") == ["LIVE", "LATE", "LOST"]
