"""People before a real browser: passkeys by an authenticator that Chromium emulates."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, CDPSession, Page, expect

from tests.e2e.desk import Served, served
from tests.unit.web.security.test_passkeys import PasskeysDesk
from tests.unit.web.security.test_people import ANA

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
def place() -> Iterator[Served[PasskeysDesk]]:
    with served(PasskeysDesk) as found:
        yield found


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with browser.new_context(locale="en-GB", service_workers="block") as context:
        yield context.new_page()


def with_authenticator(page: Page) -> CDPSession:
    line = page.context.new_cdp_session(page)
    line.send("WebAuthn.enable")
    line.send("WebAuthn.addVirtualAuthenticator", {"options": SECURITY_KEY})
    return line


def test_a_passkey_is_registered_signs_in_and_is_refused_once_it_was_removed(
    place: Served[PasskeysDesk], page: Page
) -> None:
    with_authenticator(page)
    page.goto(f"{place.url}/signin")
    page.locator("#signin-name").fill(ANA.name)
    page.locator("#signin-password").fill("acelga-1234")
    page.locator("#signin-form button").click()
    page.wait_for_url(f"{place.url}/")

    page.goto(f"{place.url}/account")
    page.locator("#passkey-name").fill("Phone")
    page.locator("#passkey-form button").click()
    expect(page.locator("#passkeys li b")).to_have_text("Phone")

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
