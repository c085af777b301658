"""Routes by which people come in and go: the page of sign-in and what it posts."""

from fastapi import APIRouter, Depends, Request, Response
from fastapi.responses import JSONResponse
from pydantic import Field

from iveg.adapters.passwords import LEAST, MOST
from iveg.models.base import Body
from iveg.web.pages.drawing import Pages
from iveg.web.problem import Problem
from iveg.web.security.answer import AnswerOfDevice
from iveg.web.security.requirements import Reader, authenticator_of, require
from iveg.web.security.single_sign_on import SingleSignOn


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


class _ByPasskey(Body):
    """What a device answered to the challenge of ``GET /signin/passkey``."""

    passkey: AnswerOfDevice


_SignIn = _ByLink | _ByPassword | _ByInvitation | _ByPasskey
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
        case _ByPasskey(passkey=answer):
            return await authenticator.sign_in_by_passkey(request, answer)


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
