"""The live page shows what the robots do, as they do it."""

import re
from collections.abc import Iterator, Mapping
from math import dist
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.e2e.conftest import live_page
from tests.e2e.reading import HALVED, card, evaluate, number, wait_for_paintings
from tests.processes import Site, until

pytestmark = [pytest.mark.e2e, pytest.mark.full_speed]

Json = Mapping[str, Any]
STOP_ALL = re.compile("PARAR T.DO")


@pytest.fixture(scope="module")
def page(browser: Browser, stack: Site) -> Iterator[Page]:
    """One page in Spanish for all tests that leave it as they found it."""
    with live_page(browser, stack, "AGI", "AGII") as live:
        yield live


def test_every_pose_and_scan_of_both_robots_is_painted(page: Page) -> None:
    robots = ("AGI", "AGII")
    began = {robot: _place(page, robot) for robot in robots}

    wait_for_paintings(page, *robots)

    def have_moved() -> bool:
        return all(dist(_place(page, it), began[it]) > 0.2 for it in robots)

    until(have_moved, "both robots elsewhere")


def test_a_person_in_the_ring_halves_the_speed_and_the_log_says_why(
    page: Page, stack: Site
) -> None:
    page.locator('#log [data-kind="speed"]', has_text=HALVED).first.wait_for()
    slow = page.locator('.card[data-level="caution"] [data-part="why"]').first
    expect(slow).not_to_be_empty()
    each = page.locator("#log-each")
    each.click()
    told = re.compile(r"\d\d:\d\d:\d\d\.\d{3} AGI+ vio .+ \(.+, \d+\W?%\)")
    expect(page.locator("#log li").first).to_contain_text(told)
    each.click()

    with stack.api() as api:

        def obeys() -> bool:
            robots = api.get("robots").json()["items"]
            return any(
                robot["mode"] == "SLOW" and _is_halved(robot) for robot in robots
            )

        until(obeys, "a robot that is SLOW at half its speed")


def test_the_language_changes_without_a_reload(page: Page) -> None:
    evaluate(page, "() => { window.sameDocument = true; }")
    expect(page.locator('#stops [data-stop="fleet"]')).to_contain_text(STOP_ALL)

    page.click('[data-language="en"]')

    expect(page.locator("html")).to_have_attribute("lang", "en")
    expect(page.locator('#stops [data-stop="fleet"]')).to_contain_text("STOP ALL")
    expect(card(page, "AGI")).to_contain_text(re.compile("LIVE"))
    assert evaluate(page, "() => window.sameDocument")

    page.click('[data-language="es"]')
    expect(page.locator('#stops [data-stop="fleet"]')).to_contain_text(STOP_ALL)


def test_the_logs_are_clean_and_hold_no_secret(page: Page, stack: Site) -> None:
    """Runs last in this module, after everything above."""
    names = ("IVEG_SIGN_IN_TOKEN", "IVEG_API_TOKEN", "IVEG_NOTIFY_TOKEN")
    said = "\n".join(program.text() for program in stack.programs)
    without_link = re.sub(r"^iVeg: http://\S+$", "", said, flags=re.MULTILINE)

    expect(page.locator("body")).to_have_attribute("data-connection", "open")
    stack.assert_clean()
    assert [name for name in names if stack.settings[name] in without_link] == []


def _place(page: Page, robot: str) -> tuple[float, float]:
    return number(page, robot, "x"), number(page, robot, "y")


def _is_halved(robot: Json) -> bool:
    limit = 0.5 * robot["profile"]["max_speed"]
    return bool(abs(robot["twist"]["linear"]) <= 1.1 * limit)
