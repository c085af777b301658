"""Single sign-on in a browser: through the page of a provider of another site, and out.

The provider is called ``localhost`` and iVeg ``127.0.0.1``: for a browser they are two
sites, so Strict cookies stay behind on the way from one to the other.
"""

import asyncio
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, expect

from tests.fakes.identity_provider import (
    CLIENT,
    KEYCLOAK,
    SECRET,
    FakeIdentityProvider,
    own_url,
    serving,
)
from tests.processes import Site, site
from tests.threads import running


@pytest.fixture
def provider() -> Iterator[FakeIdentityProvider]:
    url = own_url().replace("127.0.0.1", "localhost")
    people: dict[str, dict[str, Any]] = {
        "ana-1": dict(KEYCLOAK),
        "eva-2": {"name": "Eva"},
    }
    made, is_up = FakeIdentityProvider(url, people), threading.Event()

    async def serve() -> None:
        async with serving(made):
            is_up.set()
            await asyncio.Event().wait()

    with running(serve(), "provider"):
        assert is_up.wait(30.0)
        yield made


@pytest.fixture
def place(provider: FakeIdentityProvider, tmp_path: Path) -> Iterator[Site]:
    settings = {
        "IVEG_SSO_ISSUER": provider.url,
        "IVEG_SSO_CLIENT_ID": CLIENT,
        "IVEG_SSO_CLIENT_SECRET": SECRET,
        "IVEG_SSO_ROLE_CLAIM": "realm_access.roles",
        "IVEG_SSO_ROLES": "growers=operator",
        "IVEG_SSO_LABEL": "Cooperativa",
        "IVEG_SIGN_IN": "accounts",
    }
    with site(tmp_path, **settings) as made:
        made.start("serve")
        made.wait_until_served()
        yield made


def test_a_person_goes_through_the_providers_page_to_where_they_were_and_out(
    provider: FakeIdentityProvider, place: Site, browser: Browser
) -> None:
    with browser.new_context(base_url=place.url, locale="en-GB") as context:
        page = context.new_page()
        page.goto("/signin")
        page.get_by_role("link", name="Cooperativa").click()
        page.get_by_label("Name").fill("eva-2")
        page.get_by_role("button", name="Enter").click()
        expect(page.locator("#signin-sso")).to_contain_text("no role in iVeg")

        page.get_by_role("link", name="Cooperativa").click()
        page.get_by_label("Name").fill("ana-1")
        page.get_by_role("button", name="Enter").click()
        page.wait_for_url(f"{place.url}/")
        expect(page.locator(".user__text b")).to_have_text("Ana Núñez")
        # The session's cookie is Strict, and comes with the very first page.
        cookies = {one["name"]: one for one in context.cookies(place.url)}
        assert cookies["iveg"]["sameSite"] == "Strict"

        page.locator(".user").click()
        page.locator("#sign-out").click()
        page.wait_for_url(f"{place.url}/signin")

    log = place.programs[0].text()
    assert "eyJ" not in log
    assert SECRET not in log
