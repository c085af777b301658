"""What matters most, at each width that people have: phone, tablet, laptop, desktop.

One page lives as long as the module and is made as wide as each test wants it; the last
two tests take away the robots and then the server, so they come last.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import pytest
from playwright import sync_api
from playwright.sync_api import Browser, Locator, Page, expect

from tests.e2e.hands import in_header_or_menu, press_open
from tests.e2e.reading import (
    COVERED_STOPS,
    ON_SCREEN,
    OVERFLOW,
    SMALLEST_STOP,
    card,
    evaluate,
    strip_stop,
    visit,
)
from tests.e2e.slowly import draw_slowly
from tests.patience import PATIENCE_MS
from tests.processes import Program, Site, until

pytestmark = pytest.mark.e2e

SIZES = {390: 844, 768: 1024, 1280: 800, 1440: 900}
ROUTES = (
    *("/", "/alerts", "/commands", "/history", "/fleet", "/climate", "/settings"),
    *("/docs", "/about", "/decisions/none", "/no-such-page"),
)
WAY_TO_LOG = {
    390: '.tabbar a[href="/#log-panel"]',
    768: ".drawer-open",
    1280: "#log-title",
    1440: "#log-title",
}
GROUNDS = {
    "light": re.compile(r"^rgb\(2\d\d, "),
    "dark": re.compile(r"^rgb\(\d\d, "),
    "sunlight": re.compile(r"^rgb\(255, 255, 255\)$"),
}
METER = re.compile(r"^\d,\d\d m/s de \d,\d m/s; límite \d,\d\d m/s$")


@pytest.fixture(scope="module")
def only(browser: Browser, stack: Site) -> Iterator[Page]:
    """One signed-in page for all: drawing four maps at once would prove no more.

    Nothing slides: a drawer on its way out of a window that has just been made wider
    would be found over a card.
    """
    context = browser.new_context(locale="es-ES", reduced_motion="reduce")
    context.set_default_timeout(PATIENCE_MS)
    draw_slowly(context)
    page = context.new_page()
    page.goto(stack.sign_in_link)
    yield page
    context.close()


@pytest.fixture(params=SIZES, ids=lambda width: f"{width}px")
def width(request: pytest.FixtureRequest) -> int:
    """Of the screen (px)."""
    chosen: int = request.param
    return chosen


@pytest.fixture
def live(only: Page, width: int) -> Page:
    """The live page at a width, with both robots LIVE."""
    only.set_viewport_size({"width": width, "height": SIZES[width]})
    for robot in ("AGI", "AGII"):
        selector = f'.card[data-robot="{robot}"][data-link="LIVE"]'
        only.wait_for_selector(selector, state="attached")
    # The map hears keys from here on.
    only.wait_for_selector("#map-fit:enabled", state="attached")
    return only


def test_the_log_can_be_reached(live: Page, width: int) -> None:
    live.locator(WAY_TO_LOG[width]).first.click()

    expect(live.locator("#log li").first).to_be_in_viewport()
    assert evaluate(live, COVERED_STOPS) == []
    live.reload()


def test_a_key_follows_a_robot_and_another_fits_the_greenhouse(live: Page) -> None:
    live.keyboard.press("1")
    expect(live.locator("#following")).to_contain_text("AGI")

    live.keyboard.press("f")
    expect(live.locator("#following")).to_be_hidden()


def test_a_gauge_can_be_read_without_eyes(live: Page) -> None:
    for robot in ("AGI", "AGII"):
        gauge = card(live, robot).get_by_role("meter", name=f"Velocidad de {robot}")

        expect(gauge).to_have_attribute("aria-valuetext", METER)
        expect(gauge).to_have_attribute("aria-valuenow", re.compile(r"^\d\.\d\d$"))


def test_the_menu_of_layers_opens_by_keyboard_and_gives_the_focus_back(
    live: Page,
) -> None:
    opener = live.locator("[data-opens=layers-panel]")
    opener.focus()
    live.keyboard.press("Enter")
    layer = live.get_by_role("checkbox", name="Cuadrícula")
    expect(layer).to_be_in_viewport()
    assert evaluate(live, COVERED_STOPS) == []

    layer.focus()
    live.keyboard.press("Space")
    expect(layer).not_to_be_checked()
    live.keyboard.press("Space")
    expect(layer).to_be_checked()
    live.keyboard.press("Escape")

    expect(live.locator("#layers-panel")).to_be_hidden()
    expect(opener).to_be_focused()


def test_the_language_changes_and_nothing_grows_too_wide(live: Page) -> None:
    _choose_language(live, "en")
    expect(strip_stop(live, "fleet")).to_contain_text("STOP ALL")
    assert evaluate(live, OVERFLOW) <= 0

    _choose_language(live, "es")
    expect(strip_stop(live, "fleet")).to_contain_text(re.compile("PARAR T.DO"))


@pytest.mark.parametrize(
    ("theme", "width"), [*zip(GROUNDS, SIZES, strict=False)], indirect=["width"]
)
def test_a_theme_is_worn_at_once_and_kept(live: Page, theme: str) -> None:
    in_header_or_menu(live, "[data-opens=theme-panel]").click()
    live.locator(f"input[name=theme][value={theme}]").check()

    expect(live.locator("html")).to_have_attribute("data-theme", theme)
    expect(live.locator("body")).to_have_css("background-color", GROUNDS[theme])
    live.keyboard.press("Escape")
    live.reload()
    expect(live.locator("html")).to_have_attribute("data-theme", theme)


@pytest.mark.parametrize("width", [1280], indirect=True)
def test_a_ring_on_the_map_opens_its_decision(live: Page, stack: Site) -> None:
    panel = live.locator("#decision-panel")
    chain = panel.locator(".chain li").first

    def opens() -> bool:
        live.keyboard.press("f")
        place = _ring(live, stack)
        if place is None:
            return False
        live.locator("#map").click(position={"x": place[0], "y": place[1]})
        # The next tap comes later than a double tap would, and closes nothing.
        with suppress(sync_api.TimeoutError):
            chain.wait_for(timeout=4000)
        return chain.is_visible()

    until(opens, "a ring that opens a decision")
    assert _at_each_width(live, COVERED_STOPS) == [[]] * len(SIZES)
    live.keyboard.press("Escape")
    expect(panel).to_be_hidden()


@pytest.mark.parametrize("route", ROUTES)
def test_every_route_fits_every_screen_and_its_stops_suit_a_glove(
    only: Page, route: str, shoot: Callable[[Page, str], None]
) -> None:
    visit(only, route)
    found = {}
    for wide, high in {360: 740, **SIZES}.items():
        only.set_viewport_size({"width": wide, "height": high})
        name = route.strip("/").replace("/", "-") or "live"
        shoot(only, f"{name}-{wide}")
        # Charts hear of a new width a moment later.
        until(lambda: evaluate(only, OVERFLOW) <= 0, f"it fits {wide} px")
        found[wide] = evaluate(only, COVERED_STOPS)
        assert evaluate(only, SMALLEST_STOP) >= 64

    assert found == {wide: [] for wide in found}


@pytest.mark.parametrize("route", ["/", "/fleet"])
def test_no_dialog_covers_a_stop_at_any_width(only: Page, route: str) -> None:
    visit(only, route)
    ready = '[data-stop="AGI"][data-state="ready"]'
    only.wait_for_selector(ready, state="attached")
    found = {}
    for width, height in SIZES.items():
        only.set_viewport_size({"width": width, "height": height})
        openers = only.locator("[data-opens]:visible, .card__menu:visible").all()
        assert openers != []
        found[width] = [_covered_by(only, opener) for opener in openers]

    assert {width: [*filter(None, it)] for width, it in found.items()} == {
        width: [] for width in SIZES
    }


def test_no_message_covers_a_stop_on_any_route(only: Page, stack: Site) -> None:
    """The gravest there are: a STOP that nobody confirms."""
    _newest(stack, "emulator").kill()
    with stack.api() as api:
        api.post("fleet/stop")
    expect(only.locator("#p1 .p1__line").first).to_be_visible()

    covered = {route: _covered(only, route) for route in ROUTES}
    # Dialogs without a message: ``test_no_dialog_covers_a_stop_at_any_width``.
    covered["/"] += _covered_with_dialogs(only)

    assert covered == {route: [] for route in ROUTES}


def test_without_the_server_the_page_says_so_and_draws_a_veil(
    only: Page, stack: Site
) -> None:
    visit(only, "/")
    only.locator("#map").scroll_into_view_if_needed()
    before = until(lambda: _painted(only), "a map")

    _newest(stack, "serve").kill()

    expect(only.locator("#status")).to_contain_text("Sin conexión")
    expect(only.locator("body")).to_have_attribute("data-connection", "lost")
    until(lambda: _changed(before, _pixels(only)) > 0.2, "a veil")
    assert _at_each_width(only, COVERED_STOPS) == [[]] * len(SIZES)
    assert _at_each_width(only, OVERFLOW) == [0] * len(SIZES)


def _choose_language(page: Page, language: str) -> None:
    in_header_or_menu(page, f"button[data-language={language}]").click()
    page.keyboard.press("Escape")


def _covered(page: Page, route: str) -> list[Any]:
    """STOPs that something covers, at each width."""
    visit(page, route)
    page.wait_for_selector("#p1 .p1__line")
    return [stops for stops in _at_each_width(page, COVERED_STOPS) if stops]


def _covered_by(page: Page, opener: Locator) -> list[Any]:
    """STOPs that something covers while the dialog of a button is open."""
    press_open(page, opener)
    covered: list[Any] = evaluate(page, COVERED_STOPS)
    page.keyboard.press("Escape")
    page.wait_for_selector("dialog[open]", state="hidden")
    return covered


def _covered_with_dialogs(page: Page) -> list[Any]:
    """STOPs of the live page that something covers while a dialog is open."""
    visit(page, "/")
    page.wait_for_selector("#p1 .p1__line")
    found = []
    for opener in page.locator("[data-opens]:visible").all():
        opener.click()
        page.wait_for_selector("dialog[open]")
        found += _at_each_width(page, COVERED_STOPS)
        page.keyboard.press("Escape")
    return [stops for stops in found if stops]


def _at_each_width(page: Page, script: str) -> list[Any]:
    """What a script finds as the window is made smaller, ending at the widest."""
    found = []
    for width in (390, 768, 1280, 1440):
        page.set_viewport_size({"width": width, "height": SIZES[width]})
        found.append(evaluate(page, script))
    return found


def _ring(page: Page, stack: Site) -> tuple[float, float] | None:
    """Where on a fitted map somebody is whom a robot slows for (px)."""
    with stack.api() as api:
        people = api.get("people").json()["items"]
        robots = api.get("robots").json()["items"]
    places = [robot["pose"] for robot in robots if robot["pose"]]
    causes = {robot["speed_limit"]["cause"] for robot in robots}
    rings = [person["position"] for person in people if person["person_id"] in causes]
    found = page.evaluate(ON_SCREEN, [rings, places])
    return None if found is None else (found[0], found[1])


def _pixels(page: Page) -> list[int]:
    found: list[int] = page.locator("#map").evaluate(_THUMBNAIL)
    return found


def _painted(page: Page) -> list[int] | None:
    """The map's pixels, once it has been drawn at all."""
    found = _pixels(page)
    return found if any(found) else None


def _changed(before: list[int], after: list[int]) -> float:
    """Share of the map's pixels that differ."""
    pairs = zip(before, after, strict=True)
    return sum(abs(a - b) > 3 for a, b in pairs) / len(before)


def _newest(stack: Site, word: str) -> Program:
    return [program for program in stack.programs if program.words[0] == word][-1]


_THUMBNAIL = """(canvas) => {
  const small = new OffscreenCanvas(200, 150);
  const context = small.getContext('2d');
  context.drawImage(canvas, 0, 0, small.width, small.height);
  const {data} = context.getImageData(0, 0, small.width, small.height);
  return [...data].filter((_, i) => i % 4 === 1);
}"""
