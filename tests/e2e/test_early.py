"""What is pressed before the page has its modules, and what it says without them."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    Page,
    Request,
    Response,
    Route,
    expect,
)

from tests.browsers import sign_in
from tests.e2e.frozen import past_site
from tests.e2e.reading import strip_stop
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

MODULES = "**/static/js/main.js"
SCRIPTS = "**/static/js/**"
STOPS = "**/api/v1/**/stop"
UNLOADED = "La página no ha cargado"
PRESSED = """(control) => {
  control.dispatchEvent(new PointerEvent('pointerdown', {bubbles: true, button: 0}));
  return control.innerText;
}"""
"""A finger comes down; what the control says in the same moment."""
SHOWN_AFTER_S = "(said) => parseFloat(getComputedStyle(said).animationDelay)"
LATE_S = 2.0
"""Age from which a press that the server has not taken is shown as not sent."""


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server whose robots have never spoken: every STOP of them is taken."""
    directory: Path = tmp_path_factory.mktemp("early")
    with past_site(directory, IVEG_ROBOTS="AGI,AGII") as place:
        yield place


@pytest.fixture
def context(browser: Browser, past: Site) -> Iterator[BrowserContext]:
    """A signed-in browser on a phone."""
    size = {"width": 390, "height": 844}
    with browser.new_context(viewport=size, locale="es-ES") as found:  # type: ignore[arg-type]
        sign_in(found, past)
        yield found


class Late:
    """A page whose entry comes when a test lets it come."""

    def __init__(self, page: Page, url: str) -> None:
        self.page = page
        self._held: list[Route] = []
        self._may_load = False
        self.orders: list[Request] = []
        self.taken: list[str] = []
        page.on("request", self._note)
        page.on("response", self._note_taken)
        page.route(MODULES, self._hold)
        page.goto(url, wait_until="commit")
        page.wait_for_selector('#stops [data-stop="fleet"]')

    def _note(self, request: Request) -> None:
        if request.method == "POST":
            self.orders.append(request)

    def _note_taken(self, response: Response) -> None:
        if response.request.method == "POST" and response.status in (200, 202):
            self.taken.append(response.url.rpartition("/api/v1/")[2])

    def _hold(self, route: Route) -> None:
        if self._may_load:
            route.continue_()
        else:
            self._held.append(route)

    @property
    def presses(self) -> list[dict[str, Any]]:
        """All that was sent."""
        return [one.post_data_json or {} for one in self.orders]

    @property
    def press_ids(self) -> set[str]:
        """Of all that was sent."""
        return {one["press_id"] for one in self.presses}

    def load(self) -> None:
        """The entry comes."""
        self._may_load = True
        for route in self._held:
            route.continue_()
        self.page.wait_for_selector("body[data-loaded]")


@pytest.fixture
def late(context: BrowserContext, past: Site) -> Late:
    """The live page without its modules."""
    return Late(context.new_page(), past.url)


def test_a_press_before_the_modules_is_shown_at_once_and_sent_once(late: Late) -> None:
    control = strip_stop(late.page, "AGI")
    assert "Enviando la parada" in control.evaluate(PRESSED)
    expect(control).to_contain_text("El servidor la tiene")
    until(lambda: late.taken == ["robots/AGI/stop"], "the server took it")

    late.load()
    expect(control).not_to_contain_text(re.compile("PARAR AGI|El servidor la tiene"))
    late.page.wait_for_timeout(500)

    assert control.get_attribute("aria-busy") is None
    assert late.taken == ["robots/AGI/stop"]


def test_a_gesture_that_the_modules_come_into_is_one_press(late: Late) -> None:
    page = late.page
    strip_stop(page, "AGI").hover()
    page.mouse.down()
    late.load()
    page.mouse.up()
    page.wait_for_timeout(500)

    assert set(late.taken) == {"robots/AGI/stop"}
    assert len(late.press_ids) == 1


def test_a_press_that_nobody_took_is_shown_so_and_is_sent_late_with_its_own_time(
    late: Late,
) -> None:
    page, control = late.page, strip_stop(late.page, "AGI")
    page.route(STOPS, lambda route: route.abort())
    began = page.evaluate("Date.now()") / 1000
    assert "Enviando la parada" in control.evaluate(PRESSED)
    assert control.get_attribute("aria-busy") == "true"
    expect(control).to_contain_text("NO ENVIADA — use la seta roja")
    assert control.get_attribute("data-state") == "lost"
    assert page.evaluate("Date.now()") / 1000 - began > LATE_S

    page.unroute(STOPS)
    late.load()
    expect(control).not_to_contain_text(re.compile("PARAR AGI|NO ENVIADA"))
    page.wait_for_timeout(1500)

    assert set(late.taken) == {"robots/AGI/stop"}
    assert len(late.press_ids) == 1
    assert all(one["pressed_at"] - began < LATE_S for one in late.presses)


def test_a_press_outlives_a_page_whose_modules_never_came(late: Late) -> None:
    late.page.route(STOPS, lambda route: route.abort())
    strip_stop(late.page, "AGII").click()
    late.page.wait_for_timeout(100)
    assert late.taken == []

    late.page.unroute(STOPS)
    late.page.reload(wait_until="commit")
    expect(strip_stop(late.page, "AGII")).to_contain_text("El servidor la tiene")

    until(lambda: late.taken == ["robots/AGII/stop"], "the server took it")
    assert len(late.press_ids) == 1


def test_release_and_resume_are_never_sent_late(late: Late) -> None:
    page = late.page
    for which in ("release", "resume"):
        button = page.locator(f'[data-{which}="AGI"]')
        expect(button).to_be_disabled()
        button.scroll_into_view_if_needed()
        box = button.bounding_box()
        assert box is not None
        page.mouse.move(box["x"] + 10, box["y"] + 10)
        page.mouse.down()
    said = page.locator('[data-robot="AGI"] [data-part="release-why"]')
    expect(said).to_have_text("Cargando…")

    late.load()
    page.wait_for_timeout(2500)
    page.mouse.up()

    assert late.orders == []


def test_a_page_that_does_not_load_says_so_within_five_seconds(
    context: BrowserContext, past: Site
) -> None:
    page = context.new_page()
    page.route(SCRIPTS, lambda asked: asked.abort())
    page.goto(f"{past.url}/alerts")

    said = page.locator(".status__unloaded")
    expect(said).to_be_visible()
    # On the page's own clock, which a busy machine does not hold up.
    assert said.evaluate(SHOWN_AFTER_S) <= 5.0
    expect(said).to_contain_text(UNLOADED)
    expect(strip_stop(page, "fleet")).to_contain_text("seta roja")
    expect(strip_stop(page, "fleet")).to_have_attribute("data-state", "lost")
    high = said.evaluate("(one) => [one.scrollHeight, one.clientHeight]")
    assert high[0] <= high[1]
