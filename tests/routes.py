"""Actions that routes declare, for tests that walk all of them."""

from collections.abc import Iterator

from fastapi.dependencies.models import Dependant

from iveg.web.security.requirements import Requirement
from iveg.web.security.roles import Action


def declared_action(route: object) -> Action | None:
    """The action that a route, or its FastAPI context, declares; None without one."""
    dependant = getattr(route, "dependant", None)
    if not isinstance(dependant, Dependant):
        # A plain ASGI endpoint says it itself.
        return getattr(getattr(route, "endpoint", None), "action", None)
    actions = [
        call.action for call in _calls(dependant) if isinstance(call, Requirement)
    ]
    # A router's requirement comes before the route's own, which is stricter.
    return actions[-1] if actions else None


def _calls(dependant: Dependant) -> Iterator[object]:
    for child in dependant.dependencies:
        yield child.call
        yield from _calls(child)
