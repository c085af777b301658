"""A greenhouse whose clock stands still: one snapshot of a fleet over one history.

Pages of a real ``iveg serve`` show it, without robots, brokers or chance: for pictures,
and for where things stand on a page.
"""

import base64
import itertools
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, Route, WebSocketRoute

from iveg.adapters.history.recorder import Store
from iveg.domain.records import Record
from iveg.lab.emulator.fleet import climate_at
from iveg.ngsi.codec import format_stamp
from iveg.vital.record import Waiting
from tests.browsers import sign_in
from tests.fakes.records import (
    alert_record,
    climate_record,
    command_record,
    decision_record,
    detection_record,
    odometry_record,
)
from tests.patience import PATIENCE_MS, PATIENCE_S
from tests.processes import Site, site

NOW = 1_795_231_880.2
"""When the snapshot was taken: 04:31:20 in Madrid on 21 November 2026."""
AT = "2026-11-21T03:30:50.500Z"
"""29.7 s before the snapshot."""
HOLD = {"id": "x", "source": "iveg", "ack": "remote"}
STANDS = {"mode": "STOPPED", "twist": {"linear": 0.0, "angular": 0.0}}

Frozen = dict[str, Any]
_FILE = Path(__file__).parent / "frozen.json"


def frozen() -> Frozen:
    """The snapshot and its scans, to be changed by whoever asked for it."""
    found: Frozen = json.loads(_FILE.read_text())
    return found


def snapshot(count: int) -> Frozen:
    """The snapshot with more robots like the first two."""
    told = frozen()
    robots = told["snapshot"]["robots"]
    for n in range(count - len(robots)):
        robots.append({**robots[n % 2], "robot_id": f"R{n + 3}"})
    return told


def order(robot: str, state: str, **changes: Any) -> dict[str, Any]:
    """A STOP as ``/live`` tells it."""
    times = {"pressed": AT, "requested": AT, "sent": {}, "answer": {}, "standing": AT}
    seen = {"v": 0.4, "report_age_s": 0.1, "moved_m": 0.3}
    return {
        "command_id": f"c-{robot}",
        "robot_id": robot,
        "kind": "stop",
        "state": state,
        "requested_by": "ana",
        "times": times,
        "standstill_ms": 412.0,
        "tries": 3,
        "reason": None,
        "requesters": ["ana"],
        "hold_id": "x",
        "age_s": 29.7,
        "transports": {"direct": "ok", "fiware": "pending"},
        "robot": seen,
        "challenge_fresh": False,
        "outcome": None,
        "was_loud": False,
        "steps": [],
        **changes,
    }


@contextmanager
def past_site(directory: Path, **settings: str) -> Iterator[Site]:
    """A server over a history that never changes; no robot is there."""
    with site(directory, **settings) as place:
        store = Store(place.settings["IVEG_DATABASE_URL"])
        rows = enumerate(_history(), 1)
        store.write([Waiting(record, n, 0.0) for n, record in rows])
        store.close()
        place.start("serve")
        place.wait_until_served()
        yield place


@contextmanager
def frozen_page(
    browser: Browser,
    past: Site,
    size: tuple[int, int],
    theme: str = "light",
    language: str = "es",
    tell: Callable[[], Frozen] = frozen,
    lines: list[WebSocketRoute] | None = None,
) -> Iterator[Page]:
    """A signed-in page that will hear what ``tell`` says in place of ``/live``.

    Args:
        lines: Takes the page's lines, for whoever wants to tell more.
    """
    context = browser.new_context(
        viewport={"width": size[0], "height": size[1]},
        locale="es-ES",
        reduced_motion="reduce",
    )
    context.set_default_timeout(PATIENCE_MS)
    context.add_init_script("localStorage.setItem('iveg.hints', '3')")
    page = context.new_page()
    sign_in(context, past)
    page.goto(f"{past.url}/", wait_until="commit")
    looks = {"iveg_theme": theme, "iveg_language": language}
    context.add_cookies(
        [{"name": name, "value": look, "url": past.url} for name, look in looks.items()]
    )
    page.clock.install(time=NOW - 60.0)
    page.clock.pause_at(NOW)

    def answer(line: WebSocketRoute) -> None:
        _answer(line, tell())
        if lines is not None:
            lines.append(line)

    page.route_web_socket("**/live", answer)
    page.route("**/api/v1/history/climate", _on_that_day)
    yield page
    context.close()


def _answer(line: WebSocketRoute, frozen: Frozen) -> None:
    """Plays the snapshot and its scans, and answers pings by the standing clock."""
    line.send(json.dumps({"topic": "snapshot", "data": frozen["snapshot"]}))
    for scan in frozen["scans"]:
        line.send(base64.b64decode(scan))

    def reply(message: str | bytes) -> None:
        data = {"t": json.loads(message).get("t"), "server": NOW}
        line.send(json.dumps({"topic": "pong", "data": data}))

    line.on_message(reply)


def _on_that_day(route: Route) -> None:
    """The last 24 hours as they were then: the server's own clock goes on."""
    since, until = (format_stamp(NOW - ago) for ago in (86_400.0, 0.0))
    route.continue_(url=f"{route.request.url}?since={since}&until={until}")


def settle(page: Page, ready: str) -> None:
    """A little time of the page's own passes, until it shows what the case is about.

    What it waits for takes real time, so of that more and more passes each round.
    """
    shown = page.locator(ready).first
    deadline = time.monotonic() + PATIENCE_S
    for pause_ms in itertools.count(0, 4):
        page.clock.run_for(5)
        if shown.is_visible():
            break
        assert time.monotonic() < deadline, f"never seen: {ready}"
        page.wait_for_timeout(pause_ms)
    for _ in range(10):
        page.clock.run_for(20)
        page.evaluate("() => fetch('/healthz')")


def _history() -> Iterator[Record]:
    """A day; nothing within a second of where the last 15 minutes begin or end.

    They are asked for by the page's clock, and ``_settle`` lets it run a little.
    """
    for n in range(2, 900, 2):
        slow = 0.5 if 300 <= n < 420 else 1.0
        for robot, speed in (("AGI", 0.8), ("AGII", 0.6)):
            yield odometry_record(
                at=NOW - 900 + n,
                robot_id=robot,
                linear=speed * slow,
                limit_factor=slow,
            )
    for n in range(1440):
        at = NOW - 60 * (1440 - n)
        air: dict[str, Any] = {
            name: getattr(climate_at(at), name)
            for name in ("temperature", "relative_humidity", "co2")
        }
        yield climate_record(at=at, **air)
    yield from (
        detection_record(at=NOW - 60 * n - 30, probability=0.5 + n / 30)
        for n in range(15)
    )
    yield decision_record(started_at=NOW - 600, ended_at=NOW - 480, links=_CHAIN)
    yield command_record(
        state="RUNNING",
        requested_at=NOW - 300,
        sent_at={"direct": NOW - 299.998, "fiware": NOW - 299.99},
        answer_at={"direct": NOW - 299.95, "fiware": NOW - 299.93},
        standing_at=NOW - 299.588,
        standstill_ms=412.0,
        tries=1,
    )
    yield alert_record(
        raised_at=NOW - 600,
        last_raised_at=NOW - 600,
        cleared_at=NOW - 480,
        slots={"robot": "AGII", "person": "P1", "distance": 1.4},
    )


_CHAIN = [
    {"link": link, "at": NOW - 600 + n / 50, "value": value, "verdict": verdict}
    for n, (link, value, verdict) in enumerate(
        (
            ("detection", "farmer", "ok"),
            ("filter", 0.94, "ok"),
            ("geometry", 1.43, "ok"),
            ("rule", "fleet-alert 1", "ok"),
            ("feedback", "0.5", "ok"),
            ("applied", 0.5, "late"),
            ("observed", None, "missing"),
        )
    )
]
