"""Routes of the HTML pages and of sign-in; each page is a context to draw."""

from collections.abc import Callable
from functools import partial
from importlib.resources import files
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Path, Query, Request, Response
from fastapi.responses import (
    FileResponse,
    HTMLResponse,
    RedirectResponse,
)
from pydantic import Field

from iveg.adapters.passwords import LEAST, MOST
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.errors import SignOnError
from iveg.models.base import Body
from iveg.web.pages.drawing import Pages
from iveg.web.security.requirements import (
    READERS,
    STRANGERS,
    Reader,
    authenticator_of,
    require,
)
from iveg.web.security.roles import Action, Principal
from iveg.web.security.single_sign_on import CALLBACK, SingleSignOn

_RecordId = Annotated[str, Path(pattern=r"^[ -~]{1,64}$")]
_SCRIPTED: Final[dict[Action, dict[str, str]]] = {
    "read": {
        "live": "/",
        "alerts": "/alerts",
        "climate": "/climate",
        "commands": "/commands",
        "decisions": "/decisions",
        "fleet": "/fleet",
        "history": "/history",
        "latency": "/latency",
        "settings": "/settings",
    },
    "release": {"audit": "/audit"},
    "admin": {"users": "/users", "tokens": "/tokens", "sessions": "/sessions"},
}
"""Pages that scripts fill: required action → name → address."""
_MOVED: Final = {
    "/compare": "/day",
    "/docs": "/openapi.json",
    "/experiments": "/latency",
    "/what-if": "/settings",
}
"""Addresses of removed pages → their successors."""


def service_worker_router() -> APIRouter:
    """The service worker: at the root, so that its scope is every page; no secrets."""
    routes = APIRouter(include_in_schema=False)

    @routes.get("/sw.js", dependencies=STRANGERS)
    async def worker() -> FileResponse:
        """Never from a cache: a change must reach every device."""
        file = str(files("iveg") / "static" / "sw.js")
        headers = {"Cache-Control": "no-cache"}
        return FileResponse(file, headers=headers, media_type="text/javascript")

    return routes


def router(
    pages: Pages,
    *,
    rule: Callable[[], DetectionRule],
    sign_on: SingleSignOn | None = None,
) -> APIRouter:
    """The routes of all pages.

    Args:
        pages: Draws them.
        rule: The version in force.
        sign_on: Signs people in at the identity provider; None: there is none.
    """
    routes = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
    for needs, paths in _SCRIPTED.items():
        for route, path in paths.items():
            _add_scripted(routes, pages, route, path, needs)
    for old, new in _MOVED.items():
        _add_moved(routes, old, new)

    @routes.get("/account", response_model=None)
    async def account(request: Request, visitor: Reader) -> Response:
        return pages.draw(pages.frame(request, "account", visitor), least=LEAST)

    @routes.get("/decisions/{record_id}", name="decision", response_model=None)
    @routes.get("/commands/{record_id}", name="command", response_model=None)
    async def record(
        request: Request, visitor: Reader, record_id: _RecordId
    ) -> Response:
        frame = pages.frame(request, request.scope["route"].name, visitor)
        return pages.draw(frame, record_id=record_id)

    @routes.get("/about", response_model=None)
    async def about(request: Request, visitor: Reader) -> Response:
        return pages.draw(pages.frame(request, "about", visitor), rule=rule())

    _add_signing(routes, pages)
    if sign_on is not None:
        _add_single_sign_on(routes, pages, sign_on)
    return routes


def _add_scripted(
    routes: APIRouter, pages: Pages, route: str, path: str, needs: Action
) -> None:
    """Add a page that its script fills; ``route`` names template and script."""

    @routes.get(path, name=route, response_model=None)
    async def scripted(
        request: Request, visitor: Annotated[Principal, Depends(require(needs))]
    ) -> Response:
        return pages.draw(pages.frame(request, route, visitor))


def _add_moved(routes: APIRouter, old: str, new: str) -> None:
    """Redirect the address of a removed page to its successor."""

    @routes.get(old, dependencies=READERS, response_model=None)
    async def moved() -> Response:
        # Permanent: from then on a browser goes straight to the new page.
        return RedirectResponse(new, 308)


# --- people come in and go --------------------------------------------------------

# Every other failure is a refusal of the person (403).
_STATUS: Final = {"unreachable": 503, "busy": 429, "outdated": 400}


class _ByLink(Body):
    """The token behind the ``#`` of the link."""

    token: str = Field(max_length=256)


class _ByPassword(Body):
    """Name and password of an account."""

    name: str = Field(max_length=256)
    password: str = Field(max_length=MOST)


class _ByInvitation(Body):
    """An invitation, and the new password."""

    invitation: str = Field(max_length=256)
    password: str = Field(min_length=LEAST, max_length=MOST)


def _add_signing(routes: APIRouter, pages: Pages) -> None:
    """Add the routes of sign-in and sign-out."""

    @routes.get("/signin", response_model=None, dependencies=STRANGERS)
    async def signin(request: Request) -> Response:
        return pages.sign_in(request)

    @routes.post("/signin", response_model=None, dependencies=STRANGERS)
    async def sign_in(
        request: Request, body: _ByLink | _ByPassword | _ByInvitation
    ) -> Response:
        authenticator = authenticator_of(request)
        people = authenticator.people
        match body:
            case _ByLink():
                return authenticator.sign_in(request, body.token)
            case _ByPassword():
                proof = partial(people.sign_in, body.name, body.password)
                return await authenticator.prove(request, proof)
        proof = partial(people.accept, body.invitation, body.password)
        return await authenticator.prove(request, proof)

    # A session past its age may only stop, and can still be ended.
    @routes.post(
        "/signout", response_model=None, dependencies=[Depends(require("stop"))]
    )
    async def sign_out(request: Request) -> Response:
        return authenticator_of(request).sign_out(request)


def _add_single_sign_on(routes: APIRouter, pages: Pages, sign_on: SingleSignOn) -> None:
    """Add the routes by which a browser goes to the identity provider and back."""

    def refused(request: Request, error: SignOnError) -> Response:
        status = _STATUS.get(error.failure, 403)
        return pages.sign_in(request, status, failure=error.failure)

    @routes.get("/signin/sso", response_model=None, dependencies=STRANGERS)
    async def begin(
        request: Request, to: Annotated[str, Query(max_length=512)] = "/"
    ) -> Response:
        try:
            return await sign_on.begin(request, to)
        except SignOnError as error:
            return refused(request, error)

    @routes.get(CALLBACK, response_model=None, dependencies=STRANGERS)
    async def finish(request: Request) -> Response:
        try:
            token, to = await sign_on.finish(request)
        except SignOnError as error:
            return refused(request, error)
        response = pages.draw(pages.frame(request, "entered"), to=to)
        # After a redirect the request would still count as the provider's, and browsers
        # would leave the Strict cookie behind.
        response.headers["Refresh"] = f"0; url={to}"
        return authenticator_of(request).admit(request, token, response)
