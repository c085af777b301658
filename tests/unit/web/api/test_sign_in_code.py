"""Issue 13.16: another device signs in by a code that an operator shows it."""

import httpx
import pytest
from fastapi import FastAPI

from iveg.cli.running import reachable_host
from iveg.web import problems
from iveg.web.api import account
from iveg.web.security.authentication import Authenticator
from iveg.web.security.roles import Role
from tests.builders import START

TOKEN = "cd" * 32


async def ask(role: Role, base: str = "http://192.168.1.20:8123") -> httpx.Response:
    app = FastAPI()
    authenticator = Authenticator(
        sign_in_token=TOKEN, api_token="", clock=lambda: START
    )
    app.state.authenticator = authenticator
    app.include_router(account.sign_in_code_router(TOKEN))
    problems.install(app)
    cookie = {"Cookie": f"iveg={authenticator.sessions.open('ana', role)}"}
    transport = httpx.ASGITransport(app)
    async with httpx.AsyncClient(
        transport=transport, base_url=base, headers=cookie
    ) as browser:
        return await browser.get("/api/v1/sign-in-code")


async def test_the_link_has_the_address_and_port_that_the_browser_reached() -> None:
    told = (await ask("operator")).json()

    assert told["link"] == f"http://192.168.1.20:8123/signin#token={TOKEN}"
    assert told["image"].startswith("data:image/svg+xml")
    assert told["local"] is False


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]", "localhost"])
async def test_an_address_of_this_computer_alone_says_so(host: str) -> None:
    assert (await ask("operator", f"http://{host}:8000")).json()["local"] is True


@pytest.mark.parametrize("every", ["0.0.0.0", "::"])  # noqa: S104 - nobody listens
def test_a_server_at_every_address_is_named_by_one_that_leads_there(every: str) -> None:
    assert reachable_host(every) not in (every, "")
