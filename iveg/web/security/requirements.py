"""Role that each route requires, and its refusals in the OpenAPI document.

Every route declares its role with ``require``, and a test walks them.  In the OpenAPI
document any route may refuse with a problem (RFC 9457, ``web/problems.py``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final

from fastapi import Depends, FastAPI
from starlette.requests import HTTPConnection, Request
from starlette.websockets import WebSocket

from iveg.web.security.authentication import Authenticator
from iveg.web.security.roles import NOBODY, Action, Principal


def authenticator_of(connection: HTTPConnection) -> Authenticator:
    """The authenticator of the application (``app.state.authenticator``)."""
    authenticator: Authenticator = connection.app.state.authenticator
    return authenticator


@dataclass(frozen=True, slots=True)
class Requirement:
    """A FastAPI dependency that lets a role in; made by ``require``.

    It serves HTTP and WebSocket routes alike.
    """

    action: Action

    async def __call__(self, connection: HTTPConnection) -> Principal:
        """The authorised principal, or the error that refuses the request."""
        authenticator = authenticator_of(connection)
        if self.action == "open":
            return authenticator.identify(connection) or NOBODY
        if isinstance(connection, WebSocket):
            return await authenticator.authorise_websocket(connection)
        return authenticator.authorise(Request(connection.scope), self.action)


def require(action: Action) -> Requirement:
    """Requirement of a route: ``Depends(require("stop"))``; ``open`` asks nothing."""
    return Requirement(action)


STRANGERS: Final = [Depends(require("open"))]
READERS: Final = [Depends(require("read"))]
ADMINS: Final = [Depends(require("admin"))]
"""Dependencies of routes that need a role but not the caller."""
Reader = Annotated[Principal, Depends(require("read"))]
Presser = Annotated[Principal, Depends(require("stop"))]
Operator = Annotated[Principal, Depends(require("release"))]
Admin = Annotated[Principal, Depends(require("admin"))]


# --- refusals in the OpenAPI document ----------------------------------------------

_SHAPE: Final[Mapping[str, Any]] = {
    "title": "Problem",
    "description": "Why a request was refused (RFC 9457); more members may follow.",
    "type": "object",
    "required": ["type", "title", "status", "detail"],
    "properties": {
        "type": {"type": "string", "description": "Stable, for programs."},
        "title": {"type": "string"},
        "status": {"type": "integer"},
        "detail": {"type": "string", "description": "One sentence, for people."},
    },
}
_REFUSAL: Final[Mapping[str, Any]] = {
    "description": "A refusal",
    "content": {
        "application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}
    },
}


class DocumentedApp(FastAPI):
    """An application whose document says that any route may refuse, and how."""

    def openapi(self) -> dict[str, Any]:
        """The document; made once."""
        if self.openapi_schema is None:
            document = super().openapi()
            for operations in document["paths"].values():
                for operation in operations.values():
                    # FastAPI documents its own answer here, which is never sent.
                    operation["responses"].pop("422", None)
                    operation["responses"]["default"] = _REFUSAL
            schemas = document.setdefault("components", {}).setdefault("schemas", {})
            schemas["Problem"] = _SHAPE
        return self.openapi_schema or {}
