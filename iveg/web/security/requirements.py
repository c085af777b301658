"""What a route asks for: the role that its caller needs.

Every route declares its requirement with ``require``; ``declared_action`` reads it.
"""

from collections.abc import Iterator, Mapping
from typing import Annotated, Final

from fastapi import Depends
from fastapi.dependencies.models import Dependant
from starlette.requests import HTTPConnection, Request
from starlette.websockets import WebSocket

from iveg.web.security.authentication import Authenticator
from iveg.web.security.roles import NOBODY, Action, Principal


def authenticator_of(connection: HTTPConnection) -> Authenticator:
    """What lets people in here; it is put at ``app.state.authenticator``."""
    authenticator: Authenticator = connection.app.state.authenticator
    return authenticator


class Requirement:
    """A FastAPI dependency that lets a role in; made by ``require``.

    It serves HTTP and WebSocket routes alike.
    """

    def __init__(self, action: Action) -> None:
        self.action = action

    async def __call__(self, connection: HTTPConnection) -> Principal:
        """The authorised principal, or the error that refuses the request."""
        authenticator = authenticator_of(connection)
        if self.action == "open":
            return authenticator.identify(connection) or NOBODY
        if isinstance(connection, WebSocket):
            return await authenticator.authorise_websocket(connection)
        return authenticator.authorise(Request(connection.scope), self.action)


_REQUIREMENTS: Final[Mapping[Action, Requirement]] = {
    action: Requirement(action)
    for action in ("open", "read", "stop", "release", "admin")
}


def require(action: Action) -> Requirement:
    """Requirement of a route: ``Depends(require("stop"))``; ``open`` asks nothing."""
    return _REQUIREMENTS[action]


Reader = Annotated[Principal, Depends(require("read"))]
Presser = Annotated[Principal, Depends(require("stop"))]
Operator = Annotated[Principal, Depends(require("release"))]
Admin = Annotated[Principal, Depends(require("admin"))]


def declared_action(route: object) -> Action | None:
    """The action that a route, or its FastAPI context, declares; None without one."""
    dependant = getattr(route, "dependant", None)
    if not isinstance(dependant, Dependant):
        # A plain ASGI endpoint says it itself.
        action: Action | None = getattr(
            getattr(route, "endpoint", None), "action", None
        )
        return action
    actions = [
        call.action for call in _calls(dependant) if isinstance(call, Requirement)
    ]
    # A router's requirement comes before the route's own, which is stricter.
    return actions[-1] if actions else None


def _calls(dependant: Dependant) -> Iterator[object]:
    for child in dependant.dependencies:
        yield child.call
        yield from _calls(child)
