"""People before a real iVeg: the link, an admin's pages, and who is shut out."""

from collections.abc import Callable
from contextlib import closing

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.consoles import console
from tests.e2e.conftest import OpenPage
from tests.e2e.reading import (
    COVERED_STOPS,
    OVERFLOW,
    evaluate,
    serious,
    strip_stop,
    visit,
)
from tests.patience import AGAIN
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

ROUTES = ("/account", "/users", "/tokens", "/sessions")


@pytest.fixture
def chief(open_page: OpenPage, stack: Site) -> Page:
    """An admin's page."""
    page = open_page(route="/about", alone=True)
    invitation, _ = console(stack.directory).add("Chief", "admin")

    def is_in() -> bool:
        # The server takes accounts up within a second; five wrong tries cost a minute.
        page.wait_for_timeout(700)
        return _begin(page, stack, invitation) == 204

    until(is_in, "the admin is signed in")
    return page


def test_what_an_admin_sees_is_accessible_and_who_is_ended_while_watching_is_out(
    chief: Page,
    open_page: OpenPage,
    stack: Site,
    shoot: Callable[[Page, str], None],
) -> None:
    chief.goto(f"{stack.url}/users")
    expect(chief.locator("#users-rows")).to_contain_text("Chief")
    chief.locator("#invite-name").fill("Eva")
    chief.locator("#invite-form button").click()
    link = chief.locator("#once-text")
    expect(link).to_contain_text("#invitation=")
    invitation = str(link.text_content()).partition("#invitation=")[2]
    eva = open_page(route="/about", alone=True)
    assert _begin(eva, stack, invitation) == 204
    eva.goto(stack.url)
    expect(eva.locator("#mark")).to_have_attribute("data-state", "open")

    found = {route: _wrong(chief, route, shoot) for route in ROUTES}

    assert found == {route: [] for route in ROUTES}
    row = chief.locator("#sessions-rows tr", has_text="Eva")
    row.get_by_role("button").focus()
    chief.keyboard.press("Enter")
    chief.keyboard.press("Enter")
    expect(eva.locator("body")).to_have_attribute("data-connection", "signed-out")
    expect(strip_stop(eva, "AGI")).to_have_attribute("data-state", "lost")
    expect(row).to_have_count(0)
    stopped = eva.context.request.post(
        f"{stack.url}/api/v1/robots/AGI/stop", headers=stack.own_page, max_retries=AGAIN
    )
    assert stopped.status == 401


def test_the_link_signs_in_as_earlier_ones_do_and_its_token_is_sent_in_no_address(
    stack: Site, browser: Browser
) -> None:
    token = stack.settings["IVEG_SIGN_IN_TOKEN"]
    asked: list[str] = []
    for link in (stack.printed_link, f"{stack.url}/?token={token}"):
        with closing(browser.new_context()) as context:
            page = context.new_page()
            if link == stack.printed_link:
                page.on("request", lambda request: asked.append(request.url))
            page.goto(link)
            page.wait_for_url(f"{stack.url}/")
            expect(page.locator("#mark")).to_have_attribute("data-state", "open")

    assert asked
    assert not [url for url in asked if token in url.partition("#")[0]]


def _begin(page: Page, stack: Site, invitation: str) -> int:
    """Status of the answer to an invitation, taken in this page's browser."""
    proof = {"invitation": invitation, "password": "berenjena-77"}
    request = page.context.request
    answer = request.post(f"{stack.url}/signin", data=proof, headers=stack.own_page)
    return answer.status


def _wrong(page: Page, route: str, shoot: Callable[[Page, str], None]) -> list[object]:
    """What is inaccessible, too wide or over a STOP, on a desktop and on a phone."""
    visit(page, route)
    page.wait_for_function(
        "() => !document.querySelector('[id$=-loading]:not([hidden])')"
    )
    found: list[object] = [*serious(page)]
    for size in ({"width": 1440, "height": 900}, {"width": 390, "height": 844}):
        page.set_viewport_size(size)  # type: ignore[arg-type]
        shoot(page, f"{route[1:]}-{size['width']}")
        until(lambda: evaluate(page, OVERFLOW) <= 0, f"{route} fits")
        found += evaluate(page, COVERED_STOPS)
    return found
