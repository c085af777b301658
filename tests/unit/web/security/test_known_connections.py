"""Of whom a request is decides whether its connection stays."""

from dataclasses import dataclass, field

import pytest
from starlette.requests import HTTPConnection
from starlette.types import Message, Scope

from iveg.adapters.connection_caps import ConnectionCaps
from iveg.adapters.connections import CONNECTION, Connection, ConnectionTable
from iveg.web.security.connections import KnownConnections
from iveg.web.security.roles import Principal

PROXY, ANA, EVE = "10.0.0.9", "10.0.0.1", "10.0.0.66"
CAPS = ConnectionCaps(connections=20, of_strangers=20, of_an_address=2)


@dataclass
class Door:
    """A server behind a proxy; who has a cookie is signed in."""

    served: list[str] = field(default_factory=list)
    sent: list[Message] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.table = ConnectionTable(lambda: 0.0, CAPS, PROXY.__eq__)
        self._middleware = KnownConnections(self._app, self._identify)

    async def ask(
        self, client: str, cookie: str = "", kind: str = "http"
    ) -> Connection:
        """A request that the proxy passes on, which is being answered for ever."""
        place = self.table.admit(PROXY, lambda: None)
        assert place is not None
        place.serve()
        scope: Scope = {
            "type": kind,
            "headers": [(b"cookie", cookie.encode())],
            "client": (client, 1234),
            "state": {CONNECTION: place},
        }
        await self._middleware(scope, self._receive, self._send)
        return place

    async def _app(self, scope: Scope, *_: object) -> None:
        self.served.append(scope["client"][0])

    def _identify(self, connection: HTTPConnection) -> Principal | None:
        known = connection.headers["cookie"]
        return Principal(known, "operator") if known else None

    async def _receive(self) -> Message:
        return {"type": "http.request"}

    async def _send(self, message: Message) -> None:
        self.sent.append(message)


async def test_one_clients_requests_take_no_place_of_another_behind_the_proxy() -> None:
    door = Door()
    anas = await door.ask(ANA)
    eves = [await door.ask(EVE) for _ in range(CAPS.of_an_address + 1)]

    assert (anas.address, eves[0].address) == (ANA, EVE)
    assert door.table.counters == {"connections.gave_way": 1}
    assert len(door.table) == 1 + CAPS.of_an_address


@pytest.mark.parametrize(
    ("kind", "refusal"),
    [("http", "http.response.start"), ("websocket", "websocket.close")],
)
async def test_a_stranger_gets_no_place_of_somebody_who_is_signed_in(
    kind: str, refusal: str
) -> None:
    door = Door()
    for _ in range(CAPS.of_an_address):
        await door.ask(ANA, "ana")

    await door.ask(ANA, kind=kind)

    assert door.served == [ANA] * CAPS.of_an_address
    assert door.sent[0]["type"] == refusal
    assert door.sent[0].get("status", 503) == 503


async def test_whoever_is_signed_in_is_served_however_many_there_are() -> None:
    door = Door()
    for _ in range(10):
        await door.ask(ANA, "ana")

    assert door.served == [ANA] * 10


async def test_a_request_without_a_place_is_served() -> None:
    door = Door()
    scope: Scope = {"type": "http", "client": (ANA, 1), "headers": []}

    await KnownConnections(door._app, door._identify)(scope, door._receive, door._send)

    assert door.served == [ANA]
