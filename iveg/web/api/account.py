"""One's own account over HTTP: what is known of it, and a new password.

Sessions over HTTP: everybody's for admins, one's own for each person.

Neither a token nor its digest leaves: a session is named by an id of its own.

The sign-in link for another device: as text and as a QR code, for operators alone.

It is a password: whoever has it comes in as operator until the next start.  The page
asks for it only when somebody presses, and no cache keeps it.

Accounts of people over HTTP, for admins: invite, change a role, reset, shut out.

An invitation is a password until it is taken: it leaves by the one answer that made it.

Tokens of programs over HTTP, for admins: give, look after and revoke.

A token leaves by the one answer that made it.
"""

from ipaddress import ip_address
from typing import Annotated, Final

import segno
from fastapi import APIRouter, Depends, HTTPException, Request, Response
from pydantic import AfterValidator, Field

from iveg.adapters.admission import MOST_ACCOUNTS
from iveg.adapters.passwords import LEAST, MOST
from iveg.domain.accounts import (
    MOST_NAME,
    Account,
    Language,
    PersonRole,
    Session,
    TokenScope,
    is_name,
    is_reserved,
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
    SessionsEnded,
    SignInCode,
    UserAccount,
)
from iveg.models.base import Body, Listing, stamp
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.cookies import keep_language
from iveg.web.problems import Problem
from iveg.web.refusals import refusals
from iveg.web.security.people import People, Programs
from iveg.web.security.requirements import Admin, Reader, authenticator_of, require
from iveg.web.security.roles import Action, Principal, Role
from iveg.web.security.sessions import Sessions

_BY_LINK: Final = "link"


def sessions_router() -> APIRouter:
    """The routes of sessions."""
    routes = APIRouter(prefix="/api/v1", tags=["sessions"])
    _add(routes, "/sessions", "admin", everybodys=True)
    _add(routes, "/account/sessions", "read", everybodys=False)
    return routes


def refuse_walls(who: Principal) -> None:
    """Whoever passes a screen on a wall changes nothing of its person.

    Raises:
        HTTPException: 403.
    """
    if who.wall:
        raise HTTPException(403, "This session is a wall's: it looks and stops.")


def _add(routes: APIRouter, path: str, action: Action, *, everybodys: bool) -> None:
    """List and end the sessions that somebody may see."""
    visitor = Annotated[Principal, Depends(require(action))]

    @routes.get(path, response_model=Listing[OpenSession])
    async def listed(request: Request, who: visitor) -> Response:
        """Those that are not over; the newest sign of life first."""
        seen = _seen(request, who, everybodys=everybodys)
        seen.sort(key=lambda one: one[0].seen, reverse=True)
        return Json(Listing(items=[_open_session(*one, who) for one in seen]))

    @routes.delete(f"{path}/{{session_id}}", response_model=OpenSession)
    async def end(request: Request, session_id: str, who: visitor) -> Response:
        """End one at once, STOP included."""
        refuse_walls(who)
        for session, role in _seen(request, who, everybodys=everybodys):
            if session.session_id == session_id:
                _sessions(request).end([session])
                return Json(_open_session(session, role, who))
        raise UnknownNameError("session", session_id)

    @routes.delete(path, response_model=SessionsEnded)
    async def end_others(request: Request, who: visitor) -> Response:
        """End all but the one that asks, STOP included."""
        refuse_walls(who)
        seen = _seen(request, who, everybodys=everybodys)
        others = [one for one, _ in seen if not _is_own(one, who)]
        _sessions(request).end(others)
        return Json(SessionsEnded(ended=len(others)))


def _sessions(request: Request) -> Sessions:
    return authenticator_of(request).sessions


def _seen(
    request: Request, who: Principal, *, everybodys: bool
) -> list[tuple[Session, Role]]:
    standing = _sessions(request).standing()
    # The one of a program is nobody's, and has no session.
    own = None if who.session is None else who.person
    return [one for one in standing if everybodys or one[0].person == own]


def _is_own(session: Session, who: Principal) -> bool:
    return who.session is not None and session.digest == who.session.hex()


def _open_session(session: Session, role: Role, who: Principal) -> OpenSession:
    kind: SessionKind = "link" if session.method == _BY_LINK else "account"
    return OpenSession(
        session_id=session.session_id,
        name=session.name,
        role=role,
        kind="wall" if session.wall else kind,
        began_at=format_stamp(session.began),
        seen_at=format_stamp(session.seen),
        own=_is_own(session, who),
    )


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
        prefix="/api/v1/account", tags=["account"], responses=refusals(409, 429)
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
        people.choose_language(who.person, body.language)
        response = Response(status_code=204)
        keep_language(response, body.language)
        return response

    return routes


_SCALE = 6
"""Pixels of a module: read from an arm's length."""


def sign_in_code_router(token: str) -> APIRouter:
    """One route; ``token`` is the link's."""
    routes = APIRouter(prefix="/api/v1", tags=["sign-in"])

    @routes.get(
        "/sign-in-code",
        response_model=SignInCode,
        dependencies=[Depends(require("release"))],
    )
    async def code(request: Request) -> Response:
        """The link at the address by which this browser has reached iVeg."""
        return Json(code_of(request, f"token={token}"))

    return routes


def code_of(request: Request, proof: str) -> SignInCode:
    """A link to sign in by, at the address by which this browser has reached iVeg."""
    link = f"{str(request.base_url).rstrip('/')}/signin#{proof}"
    image = segno.make(link, micro=False).svg_data_uri(
        scale=_SCALE, border=4, dark="#000", light="#fff"
    )
    return SignInCode(
        link=link, image=image, local=is_local(request.url.hostname or "")
    )


def is_local(host: str) -> bool:
    """Whether an address leads nowhere from another device."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost" or host.endswith(".localhost")


def named(text: str) -> str:
    """A name that somebody may have. Raises ValueError."""
    if not is_name(text) or is_reserved(text):
        raise ValueError("not a name")
    return text


def end_of(days: int | None, now: float) -> float | None:
    """When something ends by itself (Unix s), after so many days; None: never."""
    return None if days is None else now + days * DAY_S


Days = Annotated[int, Field(ge=1, le=3650)]
Name = Annotated[str, Field(max_length=MOST_NAME), AfterValidator(named)]


class UserBody(Body):
    """Somebody new; `days` until the account ends by itself."""

    name: Name
    role: PersonRole
    days: Days | None = None


class RoleBody(Body):
    """The role that is to be."""

    role: PersonRole


def users_router(people: People, clock: Clock) -> APIRouter:
    """The routes of accounts; all for admins."""
    routes = APIRouter(
        prefix="/api/v1/users",
        tags=["users"],
        dependencies=[Depends(require("admin"))],
        responses=refusals(409),
    )

    @routes.get("", response_model=Listing[UserAccount])
    async def users(who: Admin) -> Response:
        """Every account, by name."""
        now = clock().wall
        items = [
            UserAccount.of(one, now, own=user_id == who.person)
            for user_id, one in people.known.items()
        ]
        items.sort(key=lambda one: name_key(one.name))
        return Json(Listing(items=items))

    @routes.post("", response_model=Invitation, status_code=201)
    async def invite(request: Request, body: UserBody, who: Admin) -> Response:
        """Add an account, and show its invitation this once."""
        now = clock().wall
        if len(people.known) >= MOST_ACCOUNTS:
            raise HTTPException(409, f"There are {MOST_ACCOUNTS} accounts already.")
        ends_at = end_of(body.days, now)
        made = people.admission(who).add(body.name, body.role, ends_at)
        return _invitation(request, made, now, 201)

    _add_changes(routes, people, clock)
    return routes


def _add_changes(routes: APIRouter, people: People, clock: Clock) -> None:
    @routes.put("/{user_id}/role", response_model=UserAccount)
    async def give_role(user_id: str, body: RoleBody, who: Admin) -> Response:
        """Change a role; the person signs in anew."""
        other = _other(people, user_id, who)
        changed = people.admission(who).give_role(other, body.role)
        return Json(UserAccount.of(changed, clock().wall))

    @routes.post("/{user_id}/reset", response_model=Invitation)
    async def reset(request: Request, user_id: str, who: Admin) -> Response:
        """Take a password away, let in who was shut out, and invite again."""
        made = people.admission(who).reset(_other(people, user_id, who))
        return _invitation(request, made, clock().wall)

    @routes.post("/{user_id}/disable", response_model=UserAccount)
    async def disable(user_id: str, who: Admin) -> Response:
        """Shut somebody out at once, STOP included."""
        off = people.admission(who).disable(_other(people, user_id, who))
        return Json(UserAccount.of(off, clock().wall))


def _other(people: People, user_id: str, who: Principal) -> Account:
    """The account of somebody else: whoever changes accounts stays admin."""
    if user_id == who.person:
        raise HTTPException(409, "Another admin changes your own account.")
    found = people.find(user_id)
    if found is None:
        raise UnknownNameError("account", user_id)
    return found


def _invitation(
    request: Request, made: tuple[str, Account], now: float, status: int = 200
) -> Response:
    invitation, account = made
    code = code_of(request, f"invitation={invitation}") if invitation else None
    return Json(Invitation(user=UserAccount.of(account, now), code=code), status)


MOST_TOKENS: Final = 200


class TokenBody(Body):
    """A program that is to come; `days` until its token ends by itself."""

    name: Name
    scope: TokenScope
    days: Days | None = None


def tokens_router(people: People, programs: Programs, clock: Clock) -> APIRouter:
    """The routes of tokens; all for admins."""
    routes = APIRouter(prefix="/api/v1/tokens", tags=["users"], responses=refusals(409))

    @routes.get(
        "",
        response_model=Listing[ProgramToken],
        dependencies=[Depends(require("admin"))],
    )
    async def tokens() -> Response:
        """Every program, by name."""
        known = sorted(programs.known, key=lambda one: name_key(one.name))
        now = clock().wall
        return Json(Listing(items=[ProgramToken.of(one, now) for one in known]))

    @routes.post("", response_model=NewToken, status_code=201)
    async def give(body: TokenBody, who: Admin) -> Response:
        """Let a program in, and show its token this once."""
        now = clock().wall
        if len(programs.known) >= MOST_TOKENS:
            raise HTTPException(409, f"There are {MOST_TOKENS} tokens already.")
        ends_at = end_of(body.days, now)
        token, program = people.admission(who).give_token(
            body.name, body.scope, ends_at
        )
        shown = NewToken(program=ProgramToken.of(program, now), token=token)
        return Json(shown, 201)

    @routes.delete("/{token_id}", status_code=204)
    async def revoke(token_id: str, who: Admin) -> None:
        """End a token at once, and the sockets of its program."""
        known = (one for one in programs.known if one.token_id == token_id)
        found = next(known, None)
        if found is None:
            raise UnknownNameError("token", token_id)
        people.admission(who).revoke(found.name)

    return routes
