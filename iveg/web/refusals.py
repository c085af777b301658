"""The OpenAPI document with what each route refuses (RFC 9457, ``web/problems.py``).

What follows from a route's role, parameters and body is added to each of them; what
else it refuses, a route names itself: ``responses=refusals(409)``.
"""

from collections.abc import Iterator, Mapping
from http import HTTPStatus
from typing import Any, Final

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts

from iveg.web.security.audited import READING
from iveg.web.security.requirements import declared_action
from iveg.web.security.roles import Action

_PROBLEM: Final = {"$ref": "#/components/schemas/Problem"}
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
_FASTAPIS_OWN: Final = ("HTTPValidationError", "ValidationError")


def refusals(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """The ``responses`` of a route that refuses with these statuses."""
    return {status: _refusal(status) for status in statuses}


class DocumentedApp(FastAPI):
    """An application whose document tells refusals as they are sent."""

    def openapi(self) -> dict[str, Any]:
        """The document; made once."""
        if self.openapi_schema is None:
            document, actions = super().openapi(), declared_actions(self)
            for path, methods in document["paths"].items():
                for method, operation in methods.items():
                    action = actions.get((path, method.upper()), "open")
                    _tell_refusals(operation, method.upper(), action)
            schemas = document.setdefault("components", {}).setdefault("schemas", {})
            for name in _FASTAPIS_OWN:
                schemas.pop(name, None)
            schemas["Problem"] = dict(_SHAPE)
        return self.openapi_schema or {}


def declared_actions(app: FastAPI) -> dict[tuple[str, str], Action]:
    """What each route asks for, by path and method."""
    return {
        (str(route.path_format), method): action
        for route in iter_route_contexts(app.routes)
        if (action := declared_action(route)) is not None
        for method in route.methods or ()
    }


def _tell_refusals(operation: dict[str, Any], method: str, action: Action) -> None:
    answers = operation["responses"]
    answers |= {str(one): _refusal(one) for one in _refused(operation, method, action)}
    operation["responses"] = dict(sorted(answers.items()))


def _refused(
    operation: Mapping[str, Any], method: str, action: Action
) -> Iterator[int]:
    if action != "open":
        yield from (401, 403)
    if any(one["in"] == "path" for one in operation.get("parameters", ())):
        yield 404
    if method not in READING:
        yield from (413, 415)
    if "422" in operation["responses"]:
        yield 422
        if "requestBody" in operation:
            yield 400


def _refusal(status: int) -> dict[str, Any]:
    return {
        "description": HTTPStatus(status).phrase,
        "content": {"application/problem+json": {"schema": dict(_PROBLEM)}},
    }
