"""Two dozen alerts on a phone: rows of what and since when, the rest a tap away."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.e2e.frozen import frozen_page, past_site, settle
from tests.e2e.reading import COVERED_STOPS, OVERFLOW, evaluate
from tests.pictures.scenes import IDS, fleet
from tests.processes import Site

pytestmark = pytest.mark.e2e

LONGEST_PX = 3000
ALERTS = 25


@pytest.fixture(scope="module")
def past(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A server that has no robots."""
    names = ",".join(IDS)
    with past_site(tmp_path_factory.mktemp("rows"), IVEG_ROBOTS=names) as place:
        yield place


@pytest.fixture(scope="module", params=["es", "en"])
def page(
    request: pytest.FixtureRequest, browser: Browser, past: Site
) -> Iterator[Page]:
    """The alerts page of a flood, on a phone."""
    told = fleet(10, "flooded")
    with frozen_page(
        browser, past, (390, 844), language=request.param, tell=lambda: told
    ) as found:
        found.goto(f"{past.url}/alerts")
        settle(found, "#past-rows tbody tr")
        yield found


def test_a_flood_is_no_longer_than_a_few_screens(page: Page) -> None:
    high = page.evaluate("() => document.documentElement.scrollHeight")

    expect(page.locator("#active-alerts > li")).to_have_count(ALERTS)
    assert high <= LONGEST_PX
    assert evaluate(page, OVERFLOW) == 0
    assert evaluate(page, LINES) == []


def test_the_gravest_alert_is_open_and_can_be_acknowledged_at_once(page: Page) -> None:
    first = page.locator("#active-alerts > li").first

    expect(first).to_have_attribute("data-priority", "P1")
    expect(first.locator("form:visible button").first).to_be_visible()
    expect(page.locator("#active-alerts > li > details[open]")).to_have_count(1)


def test_priorities_have_a_shape_and_a_colour_each(page: Page) -> None:
    found = evaluate(page, SHAPES)

    assert [priority for priority, *_ in found] == ["P1", "P2", "P3"]
    assert len({look for _, look in found}) == 3


def test_a_tap_opens_what_is_behind_a_row_and_covers_no_stop(page: Page) -> None:
    row = page.locator("#active-alerts > li").nth(3)
    expect(row.locator("form").first).to_be_hidden()

    row.locator("summary").first.click()

    expect(row.locator("form").first).to_be_visible()
    expect(row.locator(".past-link, .incident-link")).to_have_count(2)
    assert evaluate(page, COVERED_STOPS) == []
    row.locator("summary").first.click()
    expect(row.locator("form").first).to_be_hidden()


SHAPES = """() => ['P1', 'P2', 'P3'].map((priority) => {
  const shape = document.querySelector(
    `#active-alerts [data-priority="${priority}"] .shape`);
  const {backgroundColor, clipPath, borderRadius} = getComputedStyle(shape);
  return [priority, [backgroundColor, clipPath, borderRadius].join(' ')];
})"""
LINES = """() => [...document.querySelectorAll('#active-alerts .alert__head')]
  .filter((head) => head.offsetHeight < 44
    || head.querySelector('small').offsetHeight > 20
    || head.querySelector('b').offsetHeight > 42
    || head.scrollWidth > head.clientWidth)
  .map((head) => `${head.offsetHeight}: ${head.innerText}`)"""
"""Rows that are too low for a finger, or longer than two lines and one."""
