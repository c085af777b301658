"""People with accounts before a real iVeg: an admin's pages, and who is shut out."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from iveg.adapters import clock
from iveg.adapters.admission import Admission
from iveg.adapters.history.accounts import AccountStore
from iveg.domain.audit import CONSOLE
from tests.e2e.conftest import OpenPage
from tests.e2e.reading import COVERED_STOPS, OVERFLOW, evaluate, serious, visit
from tests.patience import AGAIN
from tests.processes import Site, until

pytestmark = pytest.mark.e2e

ROUTES = ("/account", "/users", "/tokens", "/sessions")


@pytest.fixture
def chief(open_page: OpenPage, stack: Site) -> Page:
    """An admin's page."""
    page = open_page(route="/about", alone=True)
    store = AccountStore(stack.settings["IVEG_DATABASE_URL"])
    invitation, _ = store.together(
        lambda rows: Admission(rows, CONSOLE, clock.wall()).add("Chief", "admin")
    )
    store.close()

    def is_in() -> bool:
        # The server reads accounts twice a second, and five wrong tries cost a minute.
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
    expect(row).to_have_count(0)
    stopped = eva.context.request.post(
        f"{stack.url}/api/v1/robots/AGI/stop", headers=_own(stack), max_retries=AGAIN
    )
    assert stopped.status == 401


def _begin(page: Page, stack: Site, invitation: str) -> int:
    """Status of the answer to an invitation, taken in this page's browser."""
    proof = {"invitation": invitation, "password": "berenjena-77"}
    headers = _own(stack)
    request = page.context.request
    return request.post(f"{stack.url}/signin", data=proof, headers=headers).status


def _own(stack: Site) -> dict[str, str]:
    return {"X-IVEG": "1", "Origin": stack.url}


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
