"""One's own account over HTTP: what is known of it, and a new password."""

from fastapi import APIRouter, HTTPException, Request, Response
from pydantic import Field

from iveg.adapters.passwords import LEAST, MOST
from iveg.domain.accounts import Language
from iveg.models.base import Body, stamp
from iveg.models.signing_in import OwnAccount
from iveg.web.api.answers import Json
from iveg.web.api.sessions import refuse_walls
from iveg.web.cookies import keep_language
from iveg.web.problem import Problem
from iveg.web.refusals import refusals
from iveg.web.security.people import People
from iveg.web.security.requirements import Reader, authenticator_of


class PasswordBody(Body):
    """The password that was, and the one that is to be."""

    old: str = Field(max_length=MOST)
    new: str = Field(min_length=LEAST, max_length=MOST)


class LanguageBody(Body):
    """The language that is to be."""

    language: Language


def router(people: People) -> APIRouter:
    """The routes of whoever asks, about themselves."""
    routes = APIRouter(
        prefix="/api/v1/account", tags=["account"], responses=refusals(409, 429, 503)
    )

    @routes.get("", response_model=OwnAccount)
    async def own(who: Reader) -> Response:
        """Who this is."""
        account = people.find(who.person)
        return Json(
            OwnAccount(
                name=who.name,
                role=who.role,
                method=who.method,
                account=who.has_account,
                signed_in_at=stamp(who.signed_in_at),
                ends_at=stamp(account.ends_at if account else None),
            )
        )

    @routes.put("/password", status_code=204)
    async def change(request: Request, body: PasswordBody, who: Reader) -> Response:
        """Change the password; every session ends but this one, which begins anew."""
        change = authenticator_of(request).change_password
        done = await change(request, who, body.old, body.new)
        if not isinstance(done, Problem):
            return done
        if done.status != 401:
            return done.response()
        return Problem(403, "The old password is wrong.", "wrong-password").response()

    @routes.put("/language", status_code=204)
    async def choose(body: LanguageBody, who: Reader) -> Response:
        """Keep a language for every browser in which the person signs in."""
        refuse_walls(who)
        if not who.has_account:
            raise HTTPException(409, "A link has no account; its browsers choose.")
        await people.choose_language(who.person, body.language)
        response = Response(status_code=204)
        keep_language(response, body.language)
        return response

    return routes
