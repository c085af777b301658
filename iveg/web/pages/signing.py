"""Routes by which people come in and go: the page of sign-in and what it posts.

The way to the identity provider and back, as a person's browser goes it.
"""

from typing import Annotated, Final

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import Field

from iveg.adapters.passwords import LEAST, MOST
from iveg.domain.errors import SignOnError
from iveg.models.base import Body
from iveg.web.pages.contexts import EnteredPage
from iveg.web.pages.drawing import Pages
from iveg.web.problems import Problem
from iveg.web.security.requirements import Reader, authenticator_of, require
from iveg.web.security.single_sign_on import CALLBACK, SingleSignOn

_STATUS: Final = {"unreachable": 503, "busy": 429, "outdated": 400}


def router(pages: Pages, sign_on: SingleSignOn) -> APIRouter:
    """The routes of single sign-on; open, as nobody is signed in there yet."""
    routes = APIRouter(include_in_schema=False, dependencies=[Depends(require("open"))])

    @routes.get("/signin/sso", response_model=None)
    async def begin(
        request: Request,
        to: Annotated[str, Query(max_length=512)] = "/",
    ) -> Response:
        try:
            return await sign_on.begin(request, to)
        except SignOnError as error:
            return _refused(pages, request, error)

    @routes.get(CALLBACK, response_model=None)
    async def finish(request: Request) -> Response:
        try:
            token, to = await sign_on.finish(request)
        except SignOnError as error:
            return _refused(pages, request, error)
        page = EnteredPage(pages.frame(request, "entered"), to)
        response = pages.draw(page)
        # A redirect would still be the provider's, and leave the Strict cookie behind.
        response.headers["Refresh"] = f"0; url={to}"
        return authenticator_of(request).admit(request, token, response)

    return routes


def _refused(pages: Pages, request: Request, error: SignOnError) -> Response:
    status = _STATUS.get(error.failure, 403)
    return pages.sign_in(request, status, failure=error.failure)


class _ByLink(Body):
    """The token behind the ``#`` of the link."""

    token: str = Field(max_length=256)


class _ByPassword(Body):
    """Who somebody says that they are, and the proof."""

    name: str = Field(max_length=256)
    password: str = Field(max_length=MOST)


class _ByInvitation(Body):
    """An invitation, and the password that is to be."""

    invitation: str = Field(max_length=256)
    password: str = Field(min_length=LEAST, max_length=MOST)


_SignIn = _ByLink | _ByPassword | _ByInvitation
"""What the sign-in page posts."""


def add_signing(routes: APIRouter, pages: Pages, sign_on: SingleSignOn | None) -> None:
    """Add the routes of sign-in, sign-out and of a screen on a wall."""

    @routes.get("/signin", response_model=None, dependencies=[Depends(require("open"))])
    async def signin(request: Request) -> Response:
        return pages.sign_in(request)

    @routes.post(
        "/signin", response_model=None, dependencies=[Depends(require("open"))]
    )
    async def sign_in(request: Request, body: _SignIn) -> Response:
        found = await _enter(request, body)
        return found.response() if isinstance(found, Problem) else found

    # Whose session is past its age can end it, too.
    @routes.post(
        "/signout", response_model=None, dependencies=[Depends(require("stop"))]
    )
    async def sign_out(request: Request) -> Response:
        return await _leave(request, sign_on)

    @routes.post("/wall", status_code=204)
    async def wall(request: Request, visitor: Reader) -> None:
        # A screen on a wall is everybody's: it looks and stops, and frees nothing.
        authenticator_of(request).sessions.lower(visitor)


async def _enter(request: Request, body: _SignIn) -> Response | Problem:
    authenticator = authenticator_of(request)
    match body:
        case _ByLink():
            return authenticator.sign_in(request, body.token)
        case _ByPassword(name=name, password=password):
            return await authenticator.sign_in_by_password(request, name, password)
        case _ByInvitation(invitation=invitation, password=password):
            return await authenticator.accept(request, invitation, password)


async def _leave(request: Request, sign_on: SingleSignOn | None) -> Response:
    """End a session, here before anywhere else."""
    authenticator = authenticator_of(request)
    who = authenticator.identify(request)
    gone = authenticator.sign_out(request)
    if sign_on is None or who is None:
        return gone
    onward = await sign_on.sign_out_address(request, who)
    if onward is None:
        return gone
    cookie = gone.headers["set-cookie"]
    return JSONResponse({"next": onward}, headers={"Set-Cookie": cookie})
