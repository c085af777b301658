"""Authentication and authorisation of people, programs and Orion.

People come with a session cookie, programs with a bearer token, Orion with a shared
secret.  What a route asks of them is in ``requirements``::

    link with token ──> session cookie ──> operator: read, stop, release, by name
    bearer token ─────────────────────────> program:  read, stop
    session past its age ─────────────────> expired:  stop, 12 h longer

STOP outlives the session (SECURITY.md): a person who was signed in once can still stop.
"""

import logging
from collections.abc import Awaitable, Callable

from starlette.exceptions import WebSocketException
from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse, Response
from starlette.websockets import WebSocket

from iveg.domain.accounts import DEFAULT_NAME, AccessBook, Account, name_key
from iveg.domain.errors import NotAllowedError
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.cookies import keep_language, session_cookie
from iveg.web.problems import NotSignedInError, Problem
from iveg.web.security.attempts import Attempts
from iveg.web.security.audited import READING
from iveg.web.security.csrf import is_own, refuse_forgery, refuse_other_bodies
from iveg.web.security.people import People, Programs
from iveg.web.security.roles import PROGRAM, Action, Principal
from iveg.web.security.secrets import same_secret
from iveg.web.security.sessions import Sessions

NO_SESSION, FOREIGN_ORIGIN = 4401, 4403
"""Close codes of ``/live``."""

_log = logging.getLogger(__name__)


class Authenticator:
    """Authenticates people and programs.

    Args:
        sign_in_token: The link's token (hex); it signs a browser in as operator.
        api_token: The bearer token of programs; empty lets no program in.
        clock: Read at each question.
        book: Who is known; None: nobody yet.
        link_name: Name of whoever holds the link.
        trail: Told of sign-ins, and of those that were refused.
        people: Those with accounts; None: there is the link alone.
        programs: Those with tokens of their own; None: there is ``api_token`` alone.
    """

    def __init__(
        self,
        *,
        sign_in_token: str,
        api_token: str,
        clock: Clock,
        book: AccessBook | None = None,
        link_name: str = DEFAULT_NAME,
        trail: AuditTrail | None = None,
        people: People | None = None,
        programs: Programs | None = None,
    ) -> None:
        self._sign_in_token = sign_in_token
        self._api_token = api_token
        self._clock = clock
        self.attempts = Attempts(clock, trail)
        self._people = people
        self._programs = programs
        self.sessions = Sessions(clock, book or AccessBook(), link_name)

    # --- people sign in ---------------------------------------------------------

    def sign_in(self, request: Request, token: str) -> Response | Problem:
        """Exchange the token that a page has posted for a session cookie.

        Raises:
            ForeignOriginError: another site's page sent it.
            NotJsonError: a body that is not JSON.
        """
        refuse_forgery(request)
        refuse_other_bodies(request)
        return self._exchange(request, token, Response(status_code=204))

    def follow_link(self, request: Request, token: str) -> Response | Problem:
        """Exchange the token in the query of an old link, or say why not."""
        response = RedirectResponse("/", 303)
        response.headers["Cache-Control"] = "no-store"
        response.headers["Referrer-Policy"] = "no-referrer"
        return self._exchange(request, token, response)

    def _exchange(
        self, request: Request, token: str, response: Response
    ) -> Response | Problem:
        address = "" if request.client is None else request.client.host
        if not same_secret(token, self._sign_in_token):
            return self.attempts.refuse(address, self._clock().mono, "wrong token")
        # Somebody else's wrong links must not shut out whoever has the right one.
        self._end_before(request)
        return self.admit(request, self.sessions.open_by_link(), response)

    async def sign_in_by_password(
        self, request: Request, name: str, password: str
    ) -> Response | Problem:
        """Exchange name and password for a session cookie; raises as ``sign_in``.

        A wrong name is told as a wrong password, and takes as long.
        """
        return await self._prove(
            request,
            lambda one: one.sign_in(name, password),
            "wrong name or password",
            name_key(name),
        )

    async def accept(
        self, request: Request, invitation: str, password: str
    ) -> Response | Problem:
        """Exchange an invitation for an account and its first session."""
        return await self._prove(
            request, lambda one: one.accept(invitation, password), "no such invitation"
        )

    async def change_password(
        self, request: Request, who: Principal, old: str, new: str
    ) -> Response | Problem:
        """Sign somebody in anew by a new password; their other sessions end.

        A wrong old one counts as a sign-in that was refused.
        """
        return await self._prove(
            request,
            lambda one: one.change_password(who, old, new),
            "wrong password",
            name_key(who.name),
        )

    async def _prove(
        self,
        request: Request,
        proof: Callable[[People], Awaitable[Account | None]],
        wrong: str,
        of: str = "",
    ) -> Response | Problem:
        people = self._people
        account = await self.attempts.weigh(
            request, wrong, lambda: None if people is None else proof(people), of
        )
        if isinstance(account, Problem):
            return account
        self._end_before(request)
        cookie = self.sessions.open(
            account.name, account.role, account.account_id, "password"
        )
        response = Response(status_code=204)
        keep_language(response, account.language)
        return self.admit(request, cookie, response)

    def admit(
        self, request: Request, cookie: str, response: Response, **facts: object
    ) -> Response:
        """Give a browser its session; the rest goes into the audit."""
        address = "" if request.client is None else request.client.host
        secure = request.url.scheme == "https"
        who = self.sessions.find(cookie)
        if who is not None:
            self.attempts.note(who, "sign_in", address, **facts)
        response.set_cookie(
            session_cookie(secure=secure),
            cookie,
            path="/",
            secure=secure,
            httponly=True,
            samesite="strict",
        )
        return response

    def sign_out(self, request: Request) -> Response:
        """End the session of this browser and redirect to the sign-in page."""
        self._end_before(request)
        response = RedirectResponse("/", 303)
        secure = request.url.scheme == "https"
        response.delete_cookie(
            session_cookie(secure=secure),
            secure=secure,
            httponly=True,
            samesite="strict",
        )
        return response

    def _end_before(self, request: Request) -> None:
        """End the session that this browser has."""
        before = self.identify(request)
        if before is not None:
            self.sessions.revoke(before)

    # --- identification ---------------------------------------------------------

    def identify(self, connection: HTTPConnection) -> Principal | None:
        """The owner of the cookie or bearer token; None for a stranger."""
        scheme, _, token = connection.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            return self._program(token.strip())
        secure = connection.scope["scheme"] in ("https", "wss")
        cookie = connection.cookies.get(session_cookie(secure=secure))
        return None if cookie is None else self.sessions.find(cookie)

    def _program(self, token: str) -> Principal | None:
        if same_secret(token, self._api_token):
            return PROGRAM
        return None if self._programs is None else self._programs.find(token)

    def current(self, principal: Principal) -> Principal | None:
        """The same person or program as of now: with what is left, or gone."""
        if principal.session is not None or principal == PROGRAM:
            return self.sessions.current(principal)
        return None if self._programs is None else self._programs.current(principal)

    def authorise(self, request: Request, action: Action) -> Principal:
        """Let a request in, or say why not.

        Raises:
            NotSignedInError: a stranger.
            NotAllowedError: the role may not do this.
            ForeignOriginError: another site's page sent it with our cookie.
            NotJsonError: a body that is not JSON.
        """
        principal = self.identify(request)
        if principal is None:
            raise NotSignedInError
        if not principal.may(action):
            raise NotAllowedError(action, principal.role)
        if principal.role == "expired" and action == "stop":
            _log.info("STOP by %s, whose session is over", principal.name)
        if request.method not in READING:
            if principal.session is not None:
                refuse_forgery(request)
            refuse_other_bodies(request)
        return principal

    async def authorise_websocket(self, websocket: WebSocket) -> Principal:
        """Let a WebSocket in; the caller accepts it.

        A foreign origin is refused before the handshake ends (HTTP 403).  A missing
        session is refused after it, because a browser sees close codes only then and
        must tell "sign in again" from "try again".

        Raises:
            WebSocketException: 4403 foreign origin, 4401 nobody signed in; Starlette
                closes the connection with it.
        """
        origin = websocket.headers.get("origin")
        principal = self.identify(websocket)
        by_cookie = principal is not None and principal.session is not None
        # Programs send no Origin; browsers always do.
        if (origin is not None or by_cookie) and not is_own(origin, websocket):
            raise WebSocketException(FOREIGN_ORIGIN)
        if principal is None or not principal.may("read"):
            # A browser that asked for a subprotocol takes no handshake without one.
            await websocket.accept(
                next(iter(websocket.scope.get("subprotocols", ())), None)
            )
            raise WebSocketException(NO_SESSION)
        return principal
