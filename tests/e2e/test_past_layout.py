"""A moment of the past, with ten robots: where things stand, and how fast it plays."""

from collections.abc import Iterator
from datetime import datetime
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from tests.e2e.frozen import frozen_page, past_site, settle
from tests.e2e.reading import COVERED_STOPS, OVERFLOW, evaluate
from tests.pictures.pages import PAGES, prepare
from tests.pictures.scenes import IDS, fleet
from tests.processes import Site

pytestmark = pytest.mark.e2e

SIZES = (
    *((390, 844), (667, 375), (844, 390)),
    *((768, 1024), (1024, 768), (1440, 900)),
)


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server that has no robots."""
    names = ",".join(IDS)
    with past_site(tmp_path_factory.mktemp("then"), IVEG_ROBOTS=names) as place:
        yield place


@pytest.fixture(scope="module")
def page(browser: Browser, past: Site) -> Iterator[Page]:
    """The page of a moment at which a robot did not obey a STOP, as now."""
    told = fleet(10, "disobeyed")
    with frozen_page(browser, past, SIZES[0], tell=lambda: told) as found:
        prepare(found, "past", told, past.url)
        found.goto(past.url + PAGES["past"])
        settle(found, "#map-fit:enabled")
        yield found


@pytest.mark.parametrize(("wide", "high"), SIZES)
def test_the_bar_of_the_past_covers_no_stop_and_no_tool_of_the_map(
    page: Page, wide: int, high: int
) -> None:
    page.set_viewport_size({"width": wide, "height": high})
    page.clock.run_for(500)

    assert evaluate(page, COVERED_STOPS) == []
    page.evaluate("() => scrollTo(0, 0)")
    assert evaluate(page, UNDER_BAR) == []
    assert evaluate(page, OVERFLOW) == 0
    expect(page.locator("#p1 .p1__line")).to_be_in_viewport(ratio=1)


def test_nobody_is_told_what_to_do_about_a_moment_that_is_past(page: Page) -> None:
    card = page.locator(".card[data-level=danger]")

    expect(card).to_have_count(1)
    expect(card.locator(".card__todo")).to_be_empty()
    expect(page.locator("#status-said")).to_contain_text("use la seta roja")


@pytest.mark.parametrize(
    ("language", "says"),
    [
        ("es", "No se puede mostrar la hora de este enlace: esto es el directo."),
        ("en", "The time in this link cannot be shown: this is live."),
    ],
)
def test_a_link_whose_time_cannot_be_read_says_that_this_is_live(
    browser: Browser, past: Site, language: str, says: str
) -> None:
    with frozen_page(browser, past, (390, 844), language=language) as page:
        page.goto(f"{past.url}/?t=garbage")
        settle(page, "#past-unread")

        assert page.locator("#past-unread").inner_text() == says
        assert page.locator("#past").count() == 0
        page.goto(past.url)
        settle(page, "#map-fit:enabled")
        assert page.locator("#past-unread").is_hidden()


def test_what_plays_keeps_its_rate_where_pictures_take_half_a_second(
    page: Page,
) -> None:
    waiting: list[Route] = []
    page.route("**/api/v1/world*", lambda route: waiting.append(route))
    began = _moment_of(page.url)
    page.locator("#past [data-part=play]").click()
    for _ in range(20):
        page.clock.run_for(500)
        page.wait_for_timeout(20)
        for route in waiting:
            route.fallback()
        waiting.clear()
        page.wait_for_timeout(20)

    assert 8.5 <= _moment_of(page.url) - began <= 10.5


def _moment_of(address: str) -> float:
    (said,) = parse_qs(urlsplit(address).query)["t"]
    return datetime.fromisoformat(said).timestamp()


UNDER_BAR = """() => {
  const bar = document.querySelector('#past').getBoundingClientRect();
  return [...document.querySelectorAll('.map-tools button')]
    .filter((one) => one.getBoundingClientRect().bottom > bar.top
      && one.getBoundingClientRect().right > bar.left)
    .map((one) => one.id);
}"""
"""Tools of the map that the bar of the past lies over."""
