"""What the page says when a part is gone, and that it comes back by itself."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.e2e.conftest import OpenPage
from tests.e2e.reading import card, evaluate, wait_for_mode
from tests.processes import EMULATOR, Program, Site

pytestmark = pytest.mark.e2e

_NOTE_LINKS = """([robot]) => {
  const card = document.querySelector(`.card[data-robot="${robot}"]`);
  const note = () => window.links.push([card.dataset.link, performance.now()]);
  window.links = [];
  new MutationObserver(note).observe(card, {attributeFilter: ['data-link']});
}"""


@pytest.fixture(autouse=True)
def mended(stack: Site) -> Iterator[None]:
    """Whatever a test broke runs again before the next."""
    yield
    for word in ("fiware", "serve", "emulator"):
        if _program(stack, word).process.poll() is not None:
            stack.start(*(EMULATOR if word == "emulator" else (word,)))
    stack.wait_until_live()


def test_a_dead_fiware_turns_robots_late_then_lost_and_all_recovers(
    page: Page, stack: Site
) -> None:
    evaluate(page, _NOTE_LINKS, "AGI")
    _program(stack, "fiware").kill()

    expect(card(page, "AGI")).to_have_attribute("data-link", "LOST")
    expect(card(page, "AGI").locator('[data-field="link"]')).to_have_text("PERDIDO")
    (late, began), (lost, ended) = page.evaluate("() => window.links")
    assert (late, lost) == ("LATE", "LOST")
    # Late at 1 s and lost at 3 s, on the clock of a page that may be busy.
    assert 1000 < ended - began < 3500

    stack.start("fiware")

    for robot in ("AGI", "AGII"):
        expect(card(page, robot)).to_have_attribute("data-link", "LIVE")
        wait_for_mode(page, robot, "RUNNING", "SLOW")


def test_a_dead_server_is_said_and_the_page_recovers(
    open_page: OpenPage, stack: Site
) -> None:
    page = open_page(alone=True)
    page.wait_for_selector('[data-robot="AGI"][data-link="LIVE"]')

    _program(stack, "serve").kill()
    expect(page.locator("#status")).to_contain_text("Sin conexión")

    stack.start("serve")
    stack.wait_until_live()

    # Nobody touches the page: its session is kept, and it finds the server by itself.
    expect(page.locator("body")).to_have_attribute("data-connection", "open")
    expect(card(page, "AGI")).to_have_attribute("data-link", "LIVE")
    expect(page.locator("#status")).not_to_contain_text("Sin conexión")
    assert page.url == f"{stack.url}/"


def test_a_dead_emulator_leaves_ghosts_not_robots(page: Page, stack: Site) -> None:
    _program(stack, "emulator").kill()

    expect(card(page, "AGII")).to_have_attribute("data-link", "LOST")


def _program(stack: Site, word: str) -> Program:
    """The newest program of this word."""
    return [program for program in stack.programs if program.words[0] == word][-1]
