"""Who a connection serves: the client behind a proxy, and whether it is signed in.

A connection of somebody who is signed in is closed last, and an open WebSocket never
(``adapters/connections``).
"""

from collections.abc import Callable, Iterable
from ipaddress import ip_address, ip_network
from typing import Final

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.adapters.connections import CONNECTION, Connection
from iveg.adapters.networks import network_of
from iveg.web.problem import Problem
from iveg.web.security.roles import Principal

_TOO_MANY: Final = Problem(
    503,
    "Too many connections of your address are open.",
    headers={"Connection": "close", "Retry-After": "1"},
)


class KnownConnections:
    """Tells the table of connections of whom each request is.

    Args:
        identify: The principal; None for a stranger.
    """

    def __init__(
        self, app: ASGIApp, identify: Callable[[HTTPConnection], Principal | None]
    ) -> None:
        self._app = app
        self._identify = identify

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        place: Connection | None = scope.get("state", {}).get(CONNECTION)
        if place is None:
            await self._app(scope, receive, send)
            return
        client = scope.get("client")
        is_free = place.belongs_to(network_of(client[0]) if client else "")
        if self._identify(HTTPConnection(scope)) is not None:
            place.vouch()
        elif not is_free:
            await _refuse(scope, receive, send)
            return
        await self._app(scope, receive, send)


async def _refuse(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http":
        await _TOO_MANY.response()(scope, receive, send)
    else:
        # Before it is accepted: the server answers 403.
        await send({"type": "websocket.close"})


def proxies(addresses: str | Iterable[str] | None) -> Callable[[str], bool]:
    """Whether an address is a trusted proxy's, from ``FORWARDED_ALLOW_IPS``.

    Names of hosts and sockets are passed over: their addresses are not known.
    """
    words = addresses.split(",") if isinstance(addresses, str) else addresses or ()
    stripped = [word.strip() for word in words]
    if "*" in stripped:
        return lambda _: True
    networks = []
    for word in stripped:
        try:
            networks.append(ip_network(word, strict=False))
        except ValueError:
            continue

    def is_proxy(address: str) -> bool:
        try:
            asked = ip_address(address)
        except ValueError:
            return False
        return any(asked in one for one in networks)

    return is_proxy
