"""STOP, Release and Resume stand where they stand, whatever else the page says.

A finger is about to press one of them: no sentence that comes or goes, no state of a
STOP and no warning may move another one under it.  The robots are those of a snapshot.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, WebSocketRoute, expect

from tests.e2e.frozen import Frozen, frozen_page, past_site, settle
from tests.e2e.reading import COVERED_STOPS, card, evaluate, strip_stop, visit
from tests.e2e.test_layout import snapshot
from tests.processes import Site

pytestmark = pytest.mark.e2e

SIZES = ((1440, 900), (768, 1024), (390, 844))
AT = "2026-11-21T03:30:50.500Z"
"""29.7 s before the snapshot."""
HOLD = {"id": "x", "source": "iveg", "ack": "remote"}
STANDS = {"mode": "STOPPED", "twist": {"linear": 0.0, "angular": 0.0}}
FAULT = {"code": "no_scan", "about": "AGI", "for_s": 12.0}


def order(robot: str, state: str, **changes: Any) -> dict[str, Any]:
    """A STOP as ``/live`` tells it."""
    times = {"pressed": AT, "requested": AT, "sent": {}, "answer": {}, "standing": AT}
    seen = {"v": 0.4, "report_age_s": 0.1, "moved_m": 0.3}
    return {
        "command_id": f"c-{robot}",
        "robot_id": robot,
        "kind": "stop",
        "drill": False,
        "state": state,
        "requested_by": "ana",
        "times": times,
        "standstill_ms": 412.0,
        "tries": 3,
        "reason": None,
        "requesters": ["ana"],
        "hold_id": "x",
        "pressed_doubted": False,
        "age_s": 29.7,
        "note": None,
        "transports": {"direct": "ok", "fiware": "pending"},
        "agent_lag_s": None,
        "robot": seen,
        "challenge_fresh": False,
        "outcome": None,
        "was_loud": False,
        "steps": [],
        **changes,
    }


COMMANDS = (
    *("REQUESTED", "SENT", "DELIVERED", "STANDING", "UNCONFIRMED", "STILL_MOVING"),
    *("STALE", "RELEASING", "READY"),
)


def states(robot: str) -> Iterator[dict[str, Any]]:
    """What a robot may say, with and without a STOP and a warning."""
    yield {}
    yield {"applied": None, "margin": None, "navigation": None, "battery": None}
    yield {"age_s": 2.0}
    yield {"age_s": 9.0, "pose": None, "twist": None}
    yield {"mode": "STOPPED", "holds": [{**HOLD, "source": "hw", "ack": "local"}]}
    for state in COMMANDS:
        held = [] if state == "READY" else [HOLD]
        yield {**STANDS, "holds": held, "stop": order(robot, state)}
    moved = order(robot, "SENT", reason="moved")
    warned = {"reason": "clear", "cause": None, "age_s": 0.3, "feedback_age_s": 0.4}
    yield {"holds": [HOLD], "stop": moved, "applied": {**warned, "faults": [FAULT]}}


@dataclass
class Told:
    """The live page, and the line by which it hears of its robots."""

    page: Page
    lines: list[WebSocketRoute]
    snapshot: Frozen

    def tell(self, n: int) -> None:
        """Each robot says the n-th thing that it may."""
        for robot in self.snapshot["snapshot"]["robots"]:
            said = list(states(robot["robot_id"]))[n]
            data = {**robot, "age_s": 0.0, **said}
            topic = f"robots/{robot['robot_id']}"
            self.lines[-1].send(json.dumps({"topic": topic, "data": data}))
        self.page.evaluate("() => fetch('/healthz')")
        self.page.clock.run_for(450)

    def places(self) -> dict[tuple[int, int], list[str]]:
        """Of every STOP, Release and Resume, in each window."""
        found = {}
        for wide, high in SIZES:
            self.page.set_viewport_size({"width": wide, "height": high})
            self.page.clock.run_for(250)
            found[wide, high] = evaluate(self.page, PLACES)
        return found


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server that has no robots."""
    directory: Path = tmp_path_factory.mktemp("strip")
    with past_site(directory) as place:
        yield place


@pytest.fixture(scope="module")
def told(
    request: pytest.FixtureRequest, browser: Browser, past: Site
) -> Iterator[Told]:
    """A page of so many robots, in one of the languages."""
    count, language = request.param
    said = snapshot(count)
    lines: list[WebSocketRoute] = []
    with frozen_page(
        browser, past, SIZES[0], language=language, tell=lambda: said, lines=lines
    ) as page:
        page.goto(past.url)
        settle(page, "#map-fit:enabled")
        page.clock.run_for(1500)  # The cards find their order.
        yield Told(page, lines, said)


@pytest.mark.parametrize("told", [(2, "es"), (2, "en"), (4, "es")], indirect=True)
def test_nothing_moves_stop_release_or_resume(told: Told) -> None:
    """Of more than two robots, Release and Resume stand in a menu, which is open."""
    if len(told.snapshot["snapshot"]["robots"]) > 2:
        card(told.page, "AGI").locator(".card__menu").click()
    before = told.places()
    for n in range(len(list(states("")))):
        told.tell(n)

        assert told.places() == before, n
        assert evaluate(told.page, SPILLED) == [], n
        both = evaluate(told.page, BOTH)
        assert [one for one, other in both if one != other] == [], n
    assert both != []


@pytest.mark.parametrize("told", [(2, "en")], indirect=True)
def test_a_late_control_is_as_red_as_a_ready_one_with_amber_under_it(
    told: Told,
) -> None:
    stop = strip_stop(told.page, "AGI")
    told.tell(0)
    ready = stop.evaluate(GROUND)
    told.tell(2)

    expect(stop).to_have_attribute("data-state", "late")
    late = stop.evaluate(GROUND)
    assert late["octagon"] == ready["octagon"]
    assert late["ink"] == ready["ink"]
    assert late["under"] != ready["under"] == "none"


@pytest.mark.parametrize("told", [(2, "en")], indirect=True)
def test_a_standstill_says_how_long_ago_it_was_seen(told: Told) -> None:
    told.tell(5 + COMMANDS.index("STANDING"))

    said = re.compile(r"STANDING STILL \((29|3\d)\.\d s ago\)")
    expect(strip_stop(told.page, "AGI")).to_contain_text(said)


@pytest.mark.parametrize("told", [(2, "es"), (4, "es"), (10, "es")], indirect=True)
def test_on_a_phone_a_stop_is_one_tap_away_and_one_of_ten_two(told: Told) -> None:
    page = told.page
    page.set_viewport_size({"width": 390, "height": 844})
    robots = told.snapshot["snapshot"]["robots"]
    for route in ("/alerts", "/about", "/settings", "/latency", "/docs", "/"):
        visit(page, route)
        page.clock.run_for(500)
        whole = strip_stop(page, "fleet")
        expect(whole).to_be_in_viewport(ratio=1)
        if len(robots) > 4:
            before = whole.bounding_box()
            page.locator("#stops-more").click()
            assert whole.bounding_box() == before

        for robot in robots:
            expect(strip_stop(page, robot["robot_id"])).to_be_in_viewport(ratio=1)
        assert evaluate(page, COVERED_STOPS) == []
    page.keyboard.press("Escape")


@pytest.mark.parametrize("told", [(2, "es"), (10, "es")], indirect=True)
def test_no_drawer_covers_a_stop_of_a_tablet(told: Told) -> None:
    page = told.page
    page.set_viewport_size({"width": 768, "height": 1024})
    page.clock.run_for(250)
    page.locator(".drawer-open").click()
    page.clock.run_for(500)

    expect(page.locator("#log-panel[data-open]")).to_be_in_viewport()
    assert evaluate(page, COVERED_STOPS) == []
    assert page.locator("#stops .stop:visible, #stops-more:visible").count() >= 2


PLACES = """() => [...document.querySelectorAll(
  '[data-stop], [data-release], [data-resume]')]
  .filter((one) => one.checkVisibility())
  .map((one) => {
    const {x, y, width, height} = one.getBoundingClientRect();
    const where = [scrollX + x, scrollY + y, width, height].map(Math.round);
    return `${one.dataset.stop ?? one.ariaLabel} ${where}`;
  })"""
SPILLED = """() => [...document.querySelectorAll('[data-stop]')]
  .filter((one) => one.checkVisibility())
  .filter((one) => {
    const {left, top, right, bottom} = one.getBoundingClientRect();
    const cut = parseFloat(getComputedStyle(one).getPropertyValue('--cut'));
    const words = document.createRange();
    words.selectNodeContents(one.querySelector('.stop__label'));
    return [...words.getClientRects()].some((line) => {
      // Letters end before their line does, and few stand in its corners.
      const [high, low] = [line.top + 2 - top, bottom + 2 - line.bottom];
      const side = Math.min(line.left - left, right - line.right);
      const end = Math.min(high, low);
      return side < 0 || end < 0 || side + end < cut - 2;
    });
  })
  .map((one) => `${one.dataset.state} ${one.innerText} ${innerWidth}`)"""
"""STOPs whose words do not fit, or run over a corner of the octagon (px)."""
BOTH = """() => [...document.querySelectorAll('.card .stop')].map((one) => {
  const twin = document.querySelector(`#stops [data-stop="${one.dataset.stop}"]`);
  return [one, twin].map((it) =>
    `${it.dataset.state} ${it.querySelector('.stop__label').textContent}`);
})"""
GROUND = """(stop) => ({
  octagon: getComputedStyle(stop, '::before').backgroundColor,
  ink: getComputedStyle(stop).color,
  under: getComputedStyle(stop, '::after').display,
})"""
