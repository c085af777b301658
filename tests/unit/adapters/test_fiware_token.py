"""The bearer for a PEP proxy: got, kept new, and never left out."""

import asyncio
import time
from collections.abc import AsyncIterator

import pytest

from iveg.adapters.bounded_json import BoundedJson
from iveg.adapters.fiware_http import HOP, FiwareToken, TokenGrant
from iveg.adapters.iot_agent import IotAgentClient
from iveg.adapters.orion import OrionClient
from iveg.adapters.transports import OrionTransport
from iveg.domain.errors import HopError
from iveg.lab.embedded.server import embedded_fiware
from tests.fakes.clock import FakeClock
from tests.fakes.pep_proxy import CLIENT, PASSWORD, SECRET, USER, FakePepProxy
from tests.fakes.serving import served

TENANT = ("agroconnect", "/greenhouse")


class Place:
    """FIWARE behind a proxy, and iVeg's two clients before it."""

    def __init__(self, pep: FakePepProxy, url: str, clock: FakeClock) -> None:
        self.pep, self.clock, self.url = pep, clock, url
        self.grant = TokenGrant(f"{url}/oauth2/token", CLIENT, SECRET)
        self.use(self.grant)

    def use(self, grant: TokenGrant) -> None:
        """Ask for a token like this from now on."""
        http = BoundedJson(HOP, timeout_s=2.0)
        self.token = FiwareToken(grant, lambda: self.clock().mono, http)
        self.orion = OrionClient(self.url, *TENANT, self.token)
        self.agent = IotAgentClient(self.url, *TENANT, self.token)


@pytest.fixture
async def place() -> AsyncIterator[Place]:
    clock = FakeClock()
    async with embedded_fiware() as fiware:
        pep = FakePepProxy(fiware.orion_url, lambda: clock().mono)
        async with served(pep.app()) as url:
            place = Place(pep, url, clock)
            yield place
            pep.is_released.set()
            await place.orion.close()
            await place.agent.close()


@pytest.mark.parametrize("header", ["Authorization", "X-Auth-Token"])
async def test_orion_behind_a_proxy_is_read_and_written_with_one_token(
    place: Place, header: str
) -> None:
    place.pep.header = header
    place.use(TokenGrant(place.grant.url, CLIENT, SECRET, header=header))  # type: ignore[arg-type]

    await asyncio.gather(*(place.orion.version() for _ in range(5)))
    robots = await place.orion.read_robots()

    assert robots == []
    assert {token for token, _ in place.pep.seen} == {"token-1"}
    assert place.pep.forms == [{"grant_type": "client_credentials"}]


async def test_keyrock_gives_a_user_s_token_by_the_password_grant(place: Place) -> None:
    place.use(TokenGrant(place.grant.url, CLIENT, SECRET, USER, PASSWORD, "permanent"))

    await place.orion.version()

    assert place.pep.forms == [
        {
            "grant_type": "password",
            "username": USER,
            "password": PASSWORD,
            "scope": "permanent",
        }
    ]


async def test_a_token_is_renewed_beside_at_four_fifths_of_its_life(
    place: Place,
) -> None:
    place.pep.life_s = 2.0
    await place.orion.version()
    place.clock.now += 1.5
    await place.orion.version()
    before = len(place.pep.forms)
    place.clock.now += 0.2
    place.pep.vice = "hangs"

    await place.orion.version()  # while the next one hangs, the old one serves
    place.pep.vice = ""
    place.pep.is_released.set()
    assert place.token._asking is not None
    await asyncio.wait([place.token._asking])
    place.clock.now += 1.0  # the old one is over
    await place.orion.version()

    assert before == 1
    assert [token for token, _ in place.pep.seen] == [*["token-1"] * 3, "token-2"]
    assert len(place.pep.forms) == 2


async def test_a_token_that_was_revoked_is_replaced_once_for_all_who_ask(
    place: Place,
) -> None:
    await place.orion.version()
    place.pep.revoke()

    await asyncio.gather(*(place.orion.version() for _ in range(5)))

    assert len(place.pep.forms) == 2
    assert place.pep.seen[-5:] == [("token-2", 200)] * 5


async def test_a_proxy_that_refuses_every_token_is_told_as_such_and_not_flooded(
    place: Place,
) -> None:
    place.pep.life_s = 0.0  # over as soon as given: 401 to each
    for _ in range(20):
        with pytest.raises(HopError, match="401 to GET /version: Invalid token: acc"):
            await place.orion.version()

    assert len(place.pep.forms) == 2


@pytest.mark.parametrize(
    ("vice", "why"),
    [
        ("down", "503 server_error"),
        ("no_token", "answered no token"),
        ("wrong_secret", "401 invalid_client"),
    ],
)
async def test_without_a_token_nothing_leaves_and_the_cause_is_the_endpoint_s(
    place: Place, vice: str, why: str
) -> None:
    place.pep.vice = vice
    if vice == "wrong_secret":
        place.use(TokenGrant(place.grant.url, CLIENT, "wrong"))

    for client, hop in ((place.orion, "orion"), (place.agent, "iot_agent")):
        with pytest.raises(HopError) as refused:
            await client.version()
        assert (refused.value.hop, refused.value.detail) == (
            hop,
            f"token endpoint down: {why}",
        )
    assert place.pep.seen == []


async def test_an_endpoint_that_is_down_is_asked_seldom_and_found_again(
    place: Place,
) -> None:
    place.pep.vice = "down"
    for _ in range(100):  # ten seconds of requests, ten a second
        with pytest.raises(HopError):
            await place.orion.version()
        place.clock.now += 0.1
    asked = len(place.pep.forms)
    place.pep.vice = ""
    place.clock.now += 3.0

    await place.orion.version()

    assert asked == 5  # once in two seconds
    assert place.pep.seen == [("token-1", 200)]


async def test_a_stop_over_fiware_waits_for_no_token_longer_than_for_orion(
    place: Place,
) -> None:
    place.pep.vice = "hangs"
    begun = time.monotonic()

    with pytest.raises(HopError, match="token endpoint down: no answer yet"):
        await OrionTransport(place.orion).stop("AGI", "01A", "ana")

    assert time.monotonic() - begun < 3.0
    assert place.pep.seen == []
