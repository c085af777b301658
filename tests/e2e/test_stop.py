"""From a press to a robot that stands, and back to one that drives."""

import re
import time
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, WebSocketRoute, expect

from iveg.ngsi.codec import format_stamp
from tests.e2e.conftest import OpenPage, live_page
from tests.e2e.hands import HELD_MS, begin_hold, hold, let_go, open_menu
from tests.e2e.reading import (
    COVERED_STOPS,
    STANDING,
    card,
    evaluate,
    number,
    strip_stop,
    wait_for_mode,
)
from tests.processes import Site, until

pytestmark = [pytest.mark.e2e, pytest.mark.full_speed]

_NOTE_WHEN = """([selector]) => {
  const control = document.querySelector(selector);
  const note = () => { window.__changedAt ??= Date.now(); };
  const options = {attributes: true, attributeFilter: ['data-state']};
  new MutationObserver(note).observe(control, options);
}"""
_ASKED_MS = """async () => {
  const began = performance.now();
  await fetch('/healthz');
  await new Promise(requestAnimationFrame);
  return performance.now() - began;
}"""
BOTH_STANDING = re.compile(r"PARADO \(2/2\)")


class Line:
    """A browser's live line, which a test can let die without closing it."""

    is_dead = False

    def join(self, page_end: WebSocketRoute) -> None:
        """Carry what both ends say, for as long as the line lives."""
        server_end = page_end.connect_to_server()
        page_end.on_message(lambda said: self._carry(server_end, said))
        server_end.on_message(lambda said: self._carry(page_end, said))

    def _carry(self, to: WebSocketRoute, said: str | bytes) -> None:
        if not self.is_dead:
            to.send(said)


@pytest.fixture(scope="module")
def scenario() -> str:
    """Nobody but the robots: behind a person one would wait for minutes."""
    return "peers"


@pytest.fixture(scope="module")
def settings() -> dict[str, str]:
    """One test looks at the past."""
    return {"IVEG_RECORDINGS": "on"}


@pytest.fixture(scope="module")
def page(browser: Browser, stack: Site) -> Iterator[Page]:
    """One for all tests."""
    with live_page(browser, stack, "AGI", "AGII") as live:
        yield live


@pytest.fixture(autouse=True)
def driving(page: Page, stack: Site) -> None:
    """Every test begins with two robots that nothing holds, and no open panel."""
    page.keyboard.press("Escape")
    for robot in ("AGI", "AGII"):
        let_go(page, stack, robot)


def test_a_press_makes_the_robot_stand_says_how_long_it_took_and_lets_others_drive(
    page: Page,
) -> None:
    strip_stop(page, "AGI").click()

    expect(strip_stop(page, "AGI")).to_contain_text(STANDING)
    expect(card(page, "AGI")).to_have_attribute("data-mode", "STOPPED")
    expect(card(page, "AGII")).to_have_attribute(
        "data-mode", re.compile("RUNNING|SLOW")
    )
    # Its speed comes on a longer way than the word that it stands.
    until(lambda: abs(number(page, "AGI", "v")) < 0.02, "AGI shows its rest")
    expect(page.locator('#log [data-kind="command"]').first).to_be_visible()


def test_a_press_in_the_past_stops_the_robot_of_now(
    page: Page, stack: Site, open_page: OpenPage
) -> None:
    at = until(lambda: _drove_at(page, stack), "a moment at which AGI drove")
    past = open_page(route=f"/?t={at}")
    expect(card(past, "AGI").locator("[data-field=x]")).not_to_have_text("—")
    expect(past.locator("#past")).to_contain_text("PASADO")
    expect(past.locator("#status-said")).to_contain_text("no en este mapa")

    expect(card(past, "AGI")).to_have_attribute("data-mode", re.compile("RUNNING|SLOW"))
    shown = str(card(past, "AGI").get_attribute("data-mode"))

    strip_stop(past, "AGI").click()

    expect(card(page, "AGI")).to_have_attribute("data-mode", "STOPPED")
    expect(strip_stop(past, "AGI")).to_contain_text(STANDING)
    expect(card(past, "AGI")).to_have_attribute("data-mode", shown)
    assert evaluate(past, COVERED_STOPS) == []
    past.keyboard.press("Escape")
    wait_for_mode(past, "AGI", "STOPPED")
    expect(past.locator("#past")).to_have_count(0)


def _drove_at(page: Page, stack: Site) -> str | None:
    """A recorded moment; None: on a busy machine nothing was recorded around it, or the
    robot had stopped by itself."""
    wait_for_mode(page, "AGI", "RUNNING")
    moment = time.time() + 1.0
    at = format_stamp(moment)
    # The page goes no nearer to now, as the newest is not recorded yet.
    page.wait_for_timeout(5000)
    with stack.api() as api:

        def world() -> Any:
            answer = api.get("world", params={"at": at})
            return answer.json() if answer.is_success else None

        told = until(world, "the past answers")
    (agi,) = (one for one in told["robots"] if one["robot_id"] == "AGI")
    drove = agi["mode"] in ("RUNNING", "SLOW")
    return at if drove and told["at_s"] > moment - 0.3 else None


def test_a_press_and_the_keyboard_stop_the_fleet(page: Page, stack: Site) -> None:
    """The keys also while a field has the focus."""
    strip_stop(page, "fleet").click()
    expect(strip_stop(page, "fleet")).to_contain_text(BOTH_STANDING)
    for robot in ("AGI", "AGII"):
        let_go(page, stack, robot)

    page.locator('[data-opens="theme-panel"]:visible').first.click()
    page.locator("#paper-colours").focus()

    page.keyboard.press("Control+.")

    expect(strip_stop(page, "fleet")).to_contain_text(BOTH_STANDING)


def test_pointer_click_and_keys_are_one_press(page: Page, stack: Site) -> None:
    began = format_stamp(time.time())
    strip_stop(page, "AGI").dblclick()
    page.keyboard.press("Enter")
    page.keyboard.press("Space")
    expect(strip_stop(page, "AGI")).to_contain_text(STANDING)

    with stack.api() as api:

        def stops() -> list[str]:
            found = api.get("commands", params={"limit": 100}).json()["items"]
            new = [one for one in found if one["times"]["requested"] >= began]
            return [one["command_id"] for one in new if one["kind"] == "stop"]

        until(stops, "the STOP is in the history")
        assert len(stops()) == 1


def test_i10_every_browser_shows_a_stop_within_a_second(
    page: Page, open_page: OpenPage
) -> None:
    other = open_page(768, 1024, route="/about")
    other.wait_for_selector('#stops [data-stop="AGI"][data-state="ready"]')
    evaluate(other, _NOTE_WHEN, '#stops [data-stop="AGI"]')
    # The finger comes first; the control of this page changes in the same moment.
    evaluate(page, _NOTE_WHEN, '#stops [data-stop="AGI"]')

    strip_stop(page, "AGI").click()

    expect(strip_stop(other, "AGI")).to_contain_text(STANDING)
    pressed, seen = (evaluate(one, "() => window.__changedAt") for one in (page, other))
    # A busy machine is given what an answer takes both of them now.
    asked_ms = sum(evaluate(one, _ASKED_MS) for one in (page, other))
    assert seen - pressed < 1000.0 + asked_ms


def test_i10_a_browser_whose_line_is_dead_shows_itself_stale(
    page: Page, open_page: OpenPage
) -> None:
    other = open_page(alone=True)
    line = Line()
    other.route_web_socket("**/live", line.join)
    other.reload()
    control = strip_stop(other, "AGI")
    expect(control).to_have_attribute("data-state", "ready")
    expect(card(other, "AGI")).to_have_attribute("data-link", "LIVE")

    line.is_dead = True

    # Half-open: nothing closes the socket, it only says nothing any more.
    expect(control).not_to_have_attribute("data-state", "ready")
    expect(card(other, "AGI")).to_have_attribute("data-link", re.compile("LATE|LOST"))
    expect(other.locator("#status")).to_contain_text("Sin conexión")
    strip_stop(page, "AGI").click()
    expect(strip_stop(page, "AGI")).to_contain_text(STANDING)
    expect(control).to_have_attribute("data-state", "lost")


def test_only_a_release_that_is_held_and_then_a_resume_drive_again(page: Page) -> None:
    strip_stop(page, "AGI").click()
    expect(strip_stop(page, "AGI")).to_contain_text(STANDING)
    open_menu(page, "AGI")
    release = page.locator('[data-release="AGI"]')
    expect(release).to_be_enabled()

    release.click(delay=200)
    begin_hold(page, release)
    page.mouse.move(0, 0)
    page.wait_for_timeout(HELD_MS)
    page.mouse.up()
    expect(page.locator('[data-resume="AGI"]')).to_be_disabled()
    expect(card(page, "AGI")).to_have_attribute("data-mode", "STOPPED")

    hold(page, release, page.locator('[data-resume="AGI"]'))
    until(lambda: abs(number(page, "AGI", "v")) < 0.02, "AGI shows its rest")

    page.locator('[data-resume="AGI"]').click()
    wait_for_mode(page, "AGI", "RUNNING", "SLOW")
    until(lambda: abs(number(page, "AGI", "v")) > 0.1, "AGI drives")
