"""What the page says when a part is gone, and that it comes back by itself."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.reading import card, wait_for_mode
from tests.processes import EMULATOR, Program, Site

pytestmark = pytest.mark.e2e


@pytest.fixture(autouse=True)
def mended(stack: Site) -> Iterator[None]:
    """Whatever a test broke runs again before the next."""
    yield
    for word in ("fiware", "serve", "emulator"):
        if _program(stack, word).process.poll() is not None:
            stack.start(*(EMULATOR if word == "emulator" else (word,)))
    stack.wait_until_live(deadline_s=60.0)


def test_a_dead_fiware_turns_robots_late_then_lost_and_all_recovers(
    page: Page, stack: Site
) -> None:
    _program(stack, "fiware").kill()

    expect(card(page, "AGI")).to_have_attribute("data-link", "LATE", timeout=2000)
    expect(card(page, "AGI")).to_have_attribute("data-link", "LOST", timeout=2500)
    expect(card(page, "AGI").locator('[data-field="link"]')).to_have_text("PERDIDO")

    stack.start("fiware")

    for robot in ("AGI", "AGII"):
        expect(card(page, robot)).to_have_attribute("data-link", "LIVE", timeout=30_000)
        wait_for_mode(page, robot, "RUNNING", "SLOW", seconds=30.0)


def test_a_dead_server_is_said_within_three_seconds_and_the_page_recovers(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(alone=True)
    page.wait_for_selector('[data-robot="AGI"][data-link="LIVE"]')

    _program(stack, "serve").kill()
    expect(page.locator("#banner")).to_contain_text("Sin conexión", timeout=3500)

    stack.start("serve")
    stack.wait_until_live(deadline_s=60.0)

    # Nobody touches the page: its session is kept, and it finds the server by itself.
    expect(page.locator("body")).to_have_attribute(
        "data-connection", "open", timeout=15_000
    )
    expect(card(page, "AGI")).to_have_attribute("data-link", "LIVE", timeout=15_000)
    expect(page.locator("#banner")).to_be_hidden()
    assert page.url == f"{stack.url}/"


def test_a_dead_emulator_leaves_ghosts_not_robots(page: Page, stack: Site) -> None:
    _program(stack, "emulator").kill()

    expect(card(page, "AGII")).to_have_attribute("data-link", "LOST", timeout=5000)


def _program(stack: Site, word: str) -> Program:
    """The newest program of this word."""
    return [program for program in stack.programs if program.words[0] == word][-1]
