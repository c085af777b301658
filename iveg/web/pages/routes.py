"""Addresses of the HTML pages: each is one context that ``Pages`` draws.

The service worker at the root, where its scope is every page.
"""

from collections.abc import Callable
from importlib.resources import files
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Path, Request, Response
from fastapi.responses import FileResponse, HTMLResponse, RedirectResponse

from iveg.adapters.passwords import LEAST
from iveg.domain.detection_rule import DetectionRule
from iveg.web.pages.contexts import AboutPage, AccountPage, Page, RecordPage
from iveg.web.pages.drawing import Pages
from iveg.web.pages.signing import add_signing
from iveg.web.security.requirements import Reader, require
from iveg.web.security.roles import Action, Principal
from iveg.web.security.single_sign_on import SingleSignOn


def service_worker_router() -> APIRouter:
    """One file, without anything that strangers may not see."""
    routes = APIRouter(include_in_schema=False)

    @routes.get("/sw.js", dependencies=[Depends(require("open"))])
    async def worker() -> FileResponse:
        """Never from a cache: a change must reach every device."""
        file = str(files("iveg") / "static" / "sw.js")
        headers = {"Cache-Control": "no-cache"}
        return FileResponse(file, headers=headers, media_type="text/javascript")

    return routes


_RECORD_ID = Annotated[str, Path(pattern=r"^[ -~]{1,64}$")]
_SCRIPTED: Final = {
    "live": "/",
    "alerts": "/alerts",
    "climate": "/climate",
    "commands": "/commands",
    "decisions": "/decisions",
    "fleet": "/fleet",
    "history": "/history",
    "latency": "/latency",
    "settings": "/settings",
}
"""Pages that scripts fill, and their addresses."""
_MOVED: Final = {
    "/compare": "/day",
    "/docs": "/openapi.json",
    "/experiments": "/latency",
    "/what-if": "/settings",
}
"""Addresses of pages that are gone, and where their readers are sent."""


def router(
    pages: Pages,
    *,
    rule: Callable[[], DetectionRule],
    sign_on: SingleSignOn | None = None,
) -> APIRouter:
    """The routes of all pages.

    Args:
        pages: What draws them.
        rule: The version in force.
        sign_on: Signs people out at the identity provider, too; None: there is none.
    """
    routes = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
    for route, path in _SCRIPTED.items():
        add_scripted(routes, pages, route, path)
    for old, new in _MOVED.items():
        _add_moved(routes, old, new)
    add_scripted(routes, pages, "audit", "/audit", "release")
    for route in ("users", "tokens", "sessions"):
        add_scripted(routes, pages, route, f"/{route}", "admin")

    @routes.get("/account", response_model=None)
    async def account(request: Request, visitor: Reader) -> Response:
        return pages.draw(AccountPage(pages.frame(request, "account", visitor), LEAST))

    @routes.get("/decisions/{decision_id}", response_model=None)
    async def decision(
        request: Request,
        visitor: Reader,
        decision_id: _RECORD_ID,
    ) -> Response:
        frame = pages.frame(request, "decision", visitor)
        return pages.draw(RecordPage(frame, decision_id))

    @routes.get("/commands/{command_id}", response_model=None)
    async def command(
        request: Request,
        visitor: Reader,
        command_id: _RECORD_ID,
    ) -> Response:
        frame = pages.frame(request, "command", visitor)
        return pages.draw(RecordPage(frame, command_id))

    @routes.get("/about", response_model=None)
    async def about(request: Request, visitor: Reader) -> Response:
        return pages.draw(AboutPage(pages.frame(request, "about", visitor), rule()))

    add_signing(routes, pages, sign_on)
    return routes


def add_scripted(
    routes: APIRouter, pages: Pages, route: str, path: str, needs: Action = "read"
) -> None:
    """Add a page that its script fills; ``route`` names template and script."""

    @routes.get(path, name=route, response_model=None)
    async def scripted(
        request: Request, visitor: Annotated[Principal, Depends(require(needs))]
    ) -> Response:
        return pages.draw(Page(pages.frame(request, route, visitor)))


def _add_moved(routes: APIRouter, old: str, new: str) -> None:
    """Lead the address of a page that is gone to the page that took its place."""

    @routes.get(old, dependencies=[Depends(require("read"))], response_model=None)
    async def moved() -> Response:
        return RedirectResponse(new, 308)
