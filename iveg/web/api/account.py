"""Access over HTTP: one's own account, sessions, accounts of others, programs.

A sign-in link, an invitation and a token are passwords: each leaves in a single answer,
which no cache keeps.  A session is named by an id of its own: neither its token nor its
digest leaves.
"""

from functools import partial
from typing import Annotated

import segno
from fastapi import APIRouter, Depends, Request, Response
from pydantic import Field
from starlette.exceptions import HTTPException

from iveg.adapters.passwords import LEAST, MOST
from iveg.domain.accounts import (
    MOST_NAME,
    Account,
    PersonRole,
    Session,
    TokenScope,
    name_key,
)
from iveg.domain.errors import UnknownNameError
from iveg.domain.retention import DAY_S
from iveg.domain.stamps import format_stamp
from iveg.models.access import (
    Invitation,
    NewToken,
    OpenSession,
    OwnAccount,
    ProgramToken,
    SessionKind,
    SignInCode,
    UserAccount,
)
from iveg.models.base import Body, Listing
from iveg.web.api.answers import Json
from iveg.web.problems import Problem
from iveg.web.security.people import People
from iveg.web.security.requirements import (
    ADMINS,
    Admin,
    Reader,
    authenticator_of,
    require,
)
from iveg.web.security.roles import Action, Principal, Role

_SCALE = 6
"""Pixels of a module of a QR code: read from an arm's length."""


def sessions_router() -> APIRouter:
    """The routes of sessions."""
    routes = APIRouter(prefix="/api/v1", tags=["sessions"])
    _add(routes, "/sessions", "admin", everybodys=True)
    _add(routes, "/account/sessions", "read", everybodys=False)
    return routes


def _add(routes: APIRouter, path: str, action: Action, *, everybodys: bool) -> None:
    """List and end the sessions that the caller may see."""
    visitor = Annotated[Principal, Depends(require(action))]

    def seen_by(request: Request, who: Principal) -> list[tuple[Session, Role]]:
        standing = authenticator_of(request).sessions.standing()
        # A program has no sessions, whatever its id is.
        own = None if who.session is None else who.person
        return [shown for shown in standing if everybodys or shown[0].person == own]

    @routes.get(path, response_model=Listing[OpenSession])
    async def listed(request: Request, who: visitor) -> Response:
        """Sessions that are not over, newest first."""
        seen = seen_by(request, who)
        seen.sort(key=lambda shown: shown[0].began, reverse=True)
        return Json(Listing(items=[_open_session(*shown, who) for shown in seen]))

    @routes.delete(f"{path}/{{session_id}}", response_model=OpenSession)
    async def end(request: Request, session_id: str, who: visitor) -> Response:
        """End a session at once, STOP included."""
        for session, role in seen_by(request, who):
            if session.session_id == session_id:
                authenticator_of(request).sessions.end(session.digest)
                return Json(_open_session(session, role, who))
        raise UnknownNameError("session", session_id)


def _open_session(session: Session, role: Role, who: Principal) -> OpenSession:
    kind: SessionKind = "link" if session.method == "link" else "account"
    return OpenSession(
        session_id=session.session_id,
        name=session.name,
        role=role,
        kind=kind,
        began_at=format_stamp(session.began),
        own=session.digest == who.session,
    )


class PasswordBody(Body):
    """The old password and the new password."""

    old: str = Field(max_length=MOST)
    new: str = Field(min_length=LEAST, max_length=MOST)


def router(people: People) -> APIRouter:
    """Routes of the caller's own account."""
    routes = APIRouter(prefix="/api/v1/account", tags=["account"])

    @routes.get("", response_model=OwnAccount)
    async def own(who: Reader) -> Response:
        """Name, role and end of the caller's account."""
        account = people.known.get(who.person)
        return Json(
            OwnAccount.from_value(
                who,
                account=who.has_account,
                ends_at=account.ends_at if account else None,
            )
        )

    @routes.put("/password", status_code=204)
    async def change(request: Request, body: PasswordBody, who: Reader) -> Response:
        """Change the password; other sessions end, and this session begins anew."""
        prove = authenticator_of(request).prove
        proof = partial(people.change_password, who, body.old, body.new)
        try:
            return await prove(request, proof)
        except HTTPException as error:
            if error.status_code != 401:
                raise
        return Problem(403, "The old password is wrong.", "wrong-password").response()

    return routes


def code_of(request: Request, proof: str) -> SignInCode:
    """Sign-in link at the address by which this browser has reached iVeg."""
    link = f"{str(request.base_url).rstrip('/')}/signin#{proof}"
    image = segno.make(link, micro=False).svg_data_uri(
        scale=_SCALE, border=4, dark="#000", light="#fff"
    )
    return SignInCode(link=link, image=image)


class _Newcomer(Body):
    """A new person or program, which ends by itself after `days`."""

    name: str = Field(max_length=MOST_NAME)
    days: Annotated[int, Field(ge=1, le=3650)] | None = None

    def ends_at(self, now: float) -> float | None:
        """Time at which it ends by itself (Unix s); None: never."""
        return None if self.days is None else now + self.days * DAY_S


class UserBody(_Newcomer):
    """A new person; `days` until the account ends by itself."""

    role: PersonRole


class RoleBody(Body):
    """The new role."""

    role: PersonRole


def users_router(people: People) -> APIRouter:
    """The routes of accounts; all for admins."""
    routes = APIRouter(
        prefix="/api/v1/users",
        tags=["users"],
        dependencies=ADMINS,
    )

    @routes.get("", response_model=Listing[UserAccount])
    async def users(who: Admin) -> Response:
        """Every account, by name."""
        now = people.clock().wall
        known = sorted(
            people.known.values(), key=lambda account: name_key(account.name)
        )
        items = [
            UserAccount.from_account(account, now, own=account.account_id == who.person)
            for account in known
        ]
        return Json(Listing(items=items))

    @routes.post("", response_model=Invitation, status_code=201)
    async def invite(request: Request, body: UserBody, who: Admin) -> Response:
        """Add an account, and show its invitation this once."""
        now = people.clock().wall
        added = people.admission(who).add(body.name, body.role, body.ends_at(now))
        return invitation(request, added, now, 201)

    def invitation(
        request: Request, added: tuple[str, Account], now: float, status: int
    ) -> Response:
        token, account = added
        code = code_of(request, f"invitation={token}") if token else None
        shown = Invitation(user=UserAccount.from_account(account, now), code=code)
        return Json(shown, status)

    @routes.put("/{user_id}/role", response_model=UserAccount)
    async def give_role(user_id: str, body: RoleBody, who: Admin) -> Response:
        """Change a role; the person signs in anew."""
        changed = people.admission(who).give_role(
            _other(people, user_id, who), body.role
        )
        return Json(UserAccount.from_account(changed, people.clock().wall))

    @routes.post("/{user_id}/reset", response_model=Invitation)
    async def reset(request: Request, user_id: str, who: Admin) -> Response:
        """Remove a password, enable the account, and invite anew."""
        added = people.admission(who).reset(_other(people, user_id, who))
        return invitation(request, added, people.clock().wall, 200)

    @routes.post("/{user_id}/disable", response_model=UserAccount)
    async def disable(user_id: str, who: Admin) -> Response:
        """Shut a person out at once, STOP included."""
        disabled = people.admission(who).disable(_other(people, user_id, who))
        return Json(UserAccount.from_account(disabled, people.clock().wall))

    return routes


def _other(people: People, user_id: str, who: Principal) -> Account:
    """The account of another person; nobody changes their own, so an admin remains."""
    if user_id == who.person:
        raise HTTPException(409, "Another admin changes your own account.")
    account = people.known.get(user_id)
    if account is None:
        raise UnknownNameError("account", user_id)
    return account


class TokenBody(_Newcomer):
    """A new program; `days` until its token ends by itself."""

    scope: TokenScope


def tokens_router(people: People) -> APIRouter:
    """The routes of tokens; all for admins."""
    routes = APIRouter(prefix="/api/v1/tokens", tags=["users"])

    @routes.get(
        "",
        response_model=Listing[ProgramToken],
        dependencies=ADMINS,
    )
    async def tokens() -> Response:
        """Every program, by name."""
        known = sorted(
            people.book.tokens.values(), key=lambda token: name_key(token.name)
        )
        now = people.clock().wall
        return Json(
            Listing(items=[ProgramToken.from_token(token, now) for token in known])
        )

    @routes.post("", response_model=NewToken, status_code=201)
    async def give(body: TokenBody, who: Admin) -> Response:
        """Let a program in, and show its token this once."""
        now = people.clock().wall
        token, program = people.admission(who).give_token(
            body.name, body.scope, body.ends_at(now)
        )
        new_token = NewToken(program=ProgramToken.from_token(program, now), token=token)
        return Json(new_token, 201)

    @routes.delete("/{token_id}", status_code=204)
    async def revoke(token_id: str, who: Admin) -> None:
        """End a token at once, and the sockets of its program."""
        for token in people.book.tokens.values():
            if token.token_id == token_id:
                return people.admission(who).revoke(token)
        raise UnknownNameError("token", token_id)

    return routes
