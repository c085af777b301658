"""Another device signs in by a code that an operator shows it."""

import pytest

from iveg.cli.running import reachable_host
from iveg.web.api import account
from tests.unit.web.desk import LINK, WebDesk


async def ask(base: str = "http://192.168.1.20:8123") -> dict[str, object]:
    desk = WebDesk()
    desk.app.include_router(account.sign_in_code_router(LINK))
    async with desk.browser() as browser:
        told: dict[str, object] = (
            await browser.get(f"{base}/api/v1/sign-in-code")
        ).json()
    return told


async def test_the_link_has_the_address_and_port_that_the_browser_reached() -> None:
    told = await ask()

    assert told["link"] == f"http://192.168.1.20:8123/signin#token={LINK}"
    assert str(told["image"]).startswith("data:image/svg+xml")
    assert told["local"] is False


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]", "localhost"])
async def test_an_address_of_this_computer_alone_says_so(host: str) -> None:
    assert (await ask(f"http://{host}:8000"))["local"] is True


@pytest.mark.parametrize("every", ["0.0.0.0", "::"])  # noqa: S104 - nobody listens
def test_a_server_at_every_address_is_named_by_one_that_leads_there(every: str) -> None:
    assert reachable_host(every) not in (every, "")
