"""The pages beside the map: complete, reachable, readable, and never over a STOP."""

import re

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.reading import (
    evaluate,
    serious,
    strip_stop,
    visit,
)
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

ROUTES = (
    "/alerts",
    "/commands",
    "/decisions",
    "/fleet",
    "/climate",
    "/latency",
    "/settings",
    "/history",
    "/about",
    "/audit",
)
THEMES = ("dark", "sunlight")


@pytest.fixture(scope="module")
def shown(stack: Site) -> Site:
    """A greenhouse in which something has happened: AGI was stopped once."""
    with stack.api() as api:
        command_id = api.post("robots/AGI/stop").json()["command_id"]

        def is_standing() -> bool:
            answer = api.get(f"commands/{command_id}")
            return bool(answer.json().get("state") == "STANDING")

        until(is_standing, "AGI stands")
    return stack


def test_every_page_is_accessible_and_the_live_one_in_every_theme(
    open_page: OpenPage, shown: Site
) -> None:
    page = open_page()

    found = {route: _violations(page, route, ()) for route in ROUTES}
    found["/"] = _violations(page, "/", THEMES)

    assert found == {route: [] for route in found}


def test_paper_has_no_controls_and_stop_is_alive_after_print_and_export(
    open_page: OpenPage, shown: Site
) -> None:
    with shown.api() as api:

        def is_kept() -> bool:
            charts = api.get("history/charts").json()["figures"]
            return "speed/AGI" in charts

        until(is_kept, "speeds in the history")
    page = open_page(route="/history")
    page.locator("#chart-speed .main-svg").nth(1).wait_for(state="attached")

    page.emulate_media(media="print")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.locator("[data-stop]:visible, .button:visible").count() == 0

    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    with page.expect_download() as download:
        page.click('[data-export="commands"][data-format="csv"]')
    assert "AGI" in download.value.path().read_text()
    expect(page.locator("#mark")).to_have_attribute("data-state", "open")
    expect(strip_stop(page, "AGI")).to_have_attribute("data-state", "standing")


def test_the_fleet_page_draws_the_whole_chain_and_each_robot(
    open_page: OpenPage,
) -> None:
    page = open_page(route="/fleet")

    for hop in ("robots", "mqtt", "iot_agent", "orion", "notifications", "screen"):
        box = page.locator(f'.hop-box[data-hop="{hop}"]')
        expect(box).to_have_attribute("data-state", "ok")
    expect(page.locator("#data-path-sentence")).to_have_text(
        re.compile("Cada dato llega")
    )
    expect(page.locator("#machines tbody tr")).to_have_count(2)


def test_a_page_says_when_its_list_cannot_be_read(open_page: OpenPage) -> None:
    page = open_page(route="/about", alone=True)
    page.route("**/api/v1/alerts*", lambda route: route.abort())

    page.goto(page.url.replace("/about", "/alerts"))

    expect(page.locator("#past-error")).to_contain_text("Sin conexión")
    expect(page.locator("#past-empty")).to_be_hidden()


def _violations(page: Page, route: str, themes: tuple[str, ...]) -> list[str]:
    """All rules in the first theme; in the others those on colour, which differ."""
    visit(page, route)
    page.wait_for_function(_LABELLED)
    found = serious(page)
    for theme in themes:
        evaluate(page, _WEAR, theme)
        found += serious(page, "color-contrast")
    return found


_WEAR = "([theme]) => { document.documentElement.dataset.theme = theme; }"
_LABELLED = """() => document.querySelector('[aria-busy=true]') === null
  && !document.querySelector('#time-strip:not([aria-label])')
  && !document.querySelector('.card__menu:not([aria-label])')"""
"""What is named in the reader's words has its name."""
