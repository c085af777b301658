"""Tokens of programs over HTTP, for admins: give, look after and revoke.

A token leaves by the one answer that made it.
"""

from typing import Final

from fastapi import APIRouter, Depends, HTTPException, Response

from iveg.adapters.program_admission import admit_program
from iveg.domain.accounts import ApiToken, TokenScope, name_key
from iveg.domain.errors import UnknownNameError
from iveg.models.base import Body, Listing
from iveg.models.programs import NewToken, ProgramToken
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.api.users import Days, Name, end_of
from iveg.web.refusals import refusals
from iveg.web.security.programs import ApiTokens, Programs
from iveg.web.security.requirements import Admin, require

MOST_TOKENS: Final = 200


class TokenBody(Body):
    """A program that is to come; `days` until its token ends by itself."""

    name: Name
    scope: TokenScope
    days: Days | None = None


def router(programs: Programs, clock: Clock) -> APIRouter:
    """The routes of tokens; all for admins."""
    routes = APIRouter(
        prefix="/api/v1/tokens", tags=["users"], responses=refusals(409, 503)
    )

    @routes.get(
        "",
        response_model=Listing[ProgramToken],
        dependencies=[Depends(require("admin"))],
    )
    async def tokens() -> Response:
        """Every program, by name."""
        known, now = await programs.known(), clock().wall
        known.sort(key=lambda one: name_key(one.name))
        return Json(Listing(items=[ProgramToken.of(one, now) for one in known]))

    @routes.post("", response_model=NewToken, status_code=201)
    async def give(body: TokenBody, who: Admin) -> Response:
        """Let a program in, and show its token this once."""
        now = clock().wall
        made = (body.name, body.scope, end_of(body.days, now))

        def work(store: ApiTokens) -> tuple[str, ApiToken]:
            if len(store.read()) >= MOST_TOKENS:
                raise HTTPException(409, f"There are {MOST_TOKENS} tokens already.")
            return admit_program(store, *made, by=who, now=now)

        token, program = await programs.change(work)
        shown = NewToken(program=ProgramToken.of(program, now), token=token)
        return Json(shown, 201)

    @routes.delete("/{token_id}", status_code=204)
    async def revoke(token_id: str, who: Admin) -> None:
        """End a token at once, and the sockets of its program."""

        def work(store: ApiTokens) -> None:
            known = (one for one in store.read().values() if one.token_id == token_id)
            found = next(known, None)
            if found is None:
                raise UnknownNameError("token", token_id)
            store.revoke(found.name, who)

        await programs.change(work)

    return routes
