"""Sessions over HTTP: everybody's for admins, one's own for each person.

Neither a token nor its digest leaves: a session is named by an id of its own.
"""

from typing import Annotated, Final

from fastapi import APIRouter, Depends, HTTPException, Request, Response

from iveg.adapters.sessions import Session
from iveg.domain.errors import UnknownNameError
from iveg.domain.stamps import format_stamp
from iveg.models.base import Listing
from iveg.models.signing_in import OpenSession, SessionKind, SessionsEnded
from iveg.web.api.answers import Json
from iveg.web.security.requirements import authenticator_of, require
from iveg.web.security.roles import Action, Principal, Role
from iveg.web.security.sessions import Sessions

_BY_LINK: Final = "link"


def router() -> APIRouter:
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
