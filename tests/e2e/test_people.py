"""People before a real browser: passkeys by an authenticator that Chromium emulates."""

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from iveg.domain.records import AuditRecord
from iveg.web.security.session_life import IDLE_S, STOP_ONLY_S
from tests.e2e.desk import Served, served
from tests.e2e.reading import serious
from tests.processes import until
from tests.unit.web.api.test_commands import stopped
from tests.unit.web.security.test_people import ANA
from tests.unit.web.security.test_proofs import QUARTER_S
from tests.unit.web.security.test_tablets import TabletsDesk

pytestmark = pytest.mark.e2e

SECURITY_KEY = {
    "protocol": "ctap2",
    "transport": "internal",
    "hasResidentKey": True,
    "hasUserVerification": True,
    "isUserVerified": True,
    "automaticPresenceSimulation": True,
}


@pytest.fixture(scope="module")
def place() -> Iterator[Served[TabletsDesk]]:
    with served(TabletsDesk) as found:
        yield found


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with browser.new_context(locale="en-GB", service_workers="block") as context:
        yield context.new_page()


def with_authenticator(page: Page) -> None:
    line = page.context.new_cdp_session(page)
    line.send("WebAuthn.enable")
    line.send("WebAuthn.addVirtualAuthenticator", {"options": SECURITY_KEY})


def sign_in(place: Served[TabletsDesk], page: Page) -> None:
    page.goto(f"{place.url}/signin")
    page.locator("#signin-name").fill(ANA.name)
    page.locator("#signin-password").fill("acelga-1234")
    page.locator("#signin-form button").click()
    page.wait_for_url(f"{place.url}/")


def test_a_passkey_is_registered_proves_signs_in_and_is_refused_once_removed(
    place: Served[TabletsDesk], page: Page
) -> None:
    with_authenticator(page)
    sign_in(place, page)
    page.goto(f"{place.url}/account")
    page.locator("#passkey-name").fill("Phone")
    page.locator("#passkey-form button").click()
    expect(page.locator("#passkeys li b")).to_have_text("Phone")

    assert serious(page) == []

    place.desk.clock.now += QUARTER_S + 1.0
    page.locator("#pin-new").fill("2580")
    page.locator("#pin-form [type=submit]").click()
    page.locator("#proof-passkey").click()
    expect(page.locator("#pin-note")).to_have_text("PIN saved.")
    expect(page.locator("#proof-panel")).to_be_hidden()

    page.context.clear_cookies()
    page.goto(f"{place.url}/signin")
    page.locator("#signin-passkey").click()
    page.wait_for_url(f"{place.url}/")
    expect(page.locator(".user__text b").first).to_have_text(ANA.name)

    page.goto(f"{place.url}/account")
    remove = page.locator("#passkeys li button")
    remove.click()
    remove.click()
    expect(page.locator("#passkeys-none")).to_be_visible()

    page.context.clear_cookies()
    page.goto(f"{place.url}/signin")
    page.locator("#signin-passkey").click()
    expect(page.locator("#signin-keyless")).to_be_visible()
    assert page.context.cookies(place.url) == []


POST = """async ([path, body]) => {
  const headers = {'X-IVEG': '1', 'Content-Type': 'application/json'};
  const asked = {method: 'POST', headers, body: JSON.stringify(body)};
  return (await fetch('/api/v1/' + path, asked)).status;
}"""


STOP_FLEET = "[data-stop=fleet]"


def released_by(desk: TabletsDesk) -> list[str]:
    rows = desk.records(AuditRecord)
    return [one.name for one in rows if one.action == "release"]


def test_a_tablet_releases_by_name_until_it_locks_by_itself_and_stops_always(
    place: Served[TabletsDesk], page: Page
) -> None:
    desk = place.desk
    sign_in(place, page)
    page.evaluate("document.querySelector('[data-opens=wall-panel]').click()")
    page.locator("#tablet-name").fill("Nave 2")
    page.locator("#tablet-make button").click()
    expect(page.locator("#tablet-said")).to_have_text("Locked")
    hold = place.run(stopped(desk))
    release = ["robots/AGI/release", {"holds": [hold]}]
    assert page.evaluate(POST, release) == 403

    page.locator("#tablet").click()
    page.get_by_role("button", name=ANA.name, exact=True).click()
    assert serious(page) == []
    page.locator("#tablet-pin").fill("2580")
    page.locator("#tablet-form button").click()
    expect(page.locator("#tablet-said")).to_have_text(ANA.name)
    expect(page.locator("#tablet-left")).to_have_text(re.compile(r"^[12]:\d\d$"))
    expect(page.locator("body")).to_have_attribute("data-role", "operator")
    assert page.evaluate(POST, release) == 202
    # The audit's row follows the answer.
    until(lambda: released_by(desk) == ["Nave 2", ANA.name], "Ana's release")

    desk.clock.now += 121.0
    page.goto(f"{place.url}/commands")
    expect(page.locator("#tablet-said")).to_have_text("Locked")
    assert page.evaluate(POST, release) == 403
    assert page.evaluate(POST, ["robots/AGI/stop", {}]) == 202


def test_a_session_that_is_over_still_stops_and_its_pages_say_so(
    place: Served[TabletsDesk], page: Page
) -> None:
    desk, stop = place.desk, ["robots/AGI/stop", {}]
    sign_in(place, page)
    hold = place.run(stopped(desk))
    connection = "data-connection"
    expect(page.locator("body")).to_have_attribute(connection, "open")
    desk.clock.now += IDLE_S + 60.0
    expect(page.locator("body")).to_have_attribute(connection, "signed-out")
    before = len(desk.fleet.stops)

    page.locator(STOP_FLEET).click()

    until(lambda: len(desk.fleet.stops) > before, "STOP by the button")
    assert page.evaluate(POST, ["robots/AGI/release", {"holds": [hold]}]) == 403
    page.goto(f"{place.url}/alerts")
    expect(page.locator(STOP_FLEET)).to_be_visible()
    expect(page.locator("#alerts-page")).to_have_count(0)
    assert page.evaluate(POST, stop) == 202

    desk.clock.now += STOP_ONLY_S
    assert page.evaluate(POST, stop) == 401
