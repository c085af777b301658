"""Authentication and authorisation of people and programs.

People come with a session cookie, programs with a bearer token.  ``requirements`` has
the role that each route needs::

    link with token ──> session cookie ──> operator: read, stop, release, by name
    bearer token ─────────────────────────> program:  read, stop
    session past its age ─────────────────> expired:  stop, 12 h longer

STOP outlives the session (SECURITY.md): a person who was signed in once can still stop.
"""

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from starlette.exceptions import WebSocketException
from starlette.requests import HTTPConnection, Request
from starlette.responses import RedirectResponse, Response
from starlette.websockets import WebSocket

from iveg.domain.accounts import DEFAULT_NAME, LINK_PERSON, Account
from iveg.domain.errors import NotAllowedError
from iveg.vital.audit import AuditTrail
from iveg.web.cookies import session_cookie
from iveg.web.problems import (
    ForeignOriginError,
    NotJsonError,
    NotSignedInError,
)
from iveg.web.security.attempts import Attempts
from iveg.web.security.audited import READING
from iveg.web.security.people import People
from iveg.web.security.roles import PROGRAM, Action, Principal
from iveg.web.security.secrets import same_secret
from iveg.web.security.sessions import Sessions

NO_SESSION, FOREIGN_ORIGIN = 4401, 4403
"""Close codes of ``/live``."""


@dataclass(frozen=True, slots=True)
class Credentials:
    """Secrets of the environment that give access; an empty secret gives none.

    Attributes:
        link: The sign-in link's token (hex); it signs a browser in as operator.
        api_token: The bearer token of programs.
        link_name: Name of the person who signs in by the link.
    """

    link: str = field(repr=False)
    api_token: str = field(repr=False)
    link_name: str = DEFAULT_NAME


class Authenticator:
    """Authenticates people and programs.

    Args:
        credentials: Secrets of the environment.
        people: People with accounts, and programs with tokens of their own.
        trail: Records sign-ins and refused sign-ins.
    """

    def __init__(
        self, credentials: Credentials, people: People, trail: AuditTrail
    ) -> None:
        self._credentials = credentials
        self.people = people
        self.attempts = Attempts(people.clock, trail)
        self.sessions = Sessions(people.clock, people.book)

    # --- people sign in ---------------------------------------------------------

    def sign_in(self, request: Request, token: str) -> Response:
        """Exchange the token that a page has posted for a session cookie.

        Raises:
            HTTPException: it is wrong, or too many were wrong.
            ForeignOriginError: another site's page sent it.
            NotJsonError: a body that is not JSON.
        """
        refuse_forgery(request)
        # No wait before the right link: wrong links of others behind the same address
        # must not shut its holder out.
        if not same_secret(token, self._credentials.link):
            self.attempts.refuse(request)
        # A browser has one session, and its cookie is about to be replaced.
        self._end_before(request)
        name = self._credentials.link_name
        cookie = self.sessions.open(name, "operator", LINK_PERSON)
        return self.admit(request, cookie, Response(status_code=204))

    async def prove(
        self, request: Request, proof: Callable[[], Awaitable[Account | None]]
    ) -> Response:
        """Exchange a proof for a session cookie; raises as ``sign_in``.

        Args:
            request: Request that brings the proof.
            proof: Finds the account that it proves; None where it is wrong.

        Raises:
            BusyError: too many sign in at once.
        """
        refuse_forgery(request)
        self.attempts.refuse_waiting(request)
        account = await proof()
        if account is None:
            self.attempts.refuse(request)
        self._end_before(request)
        cookie = self.sessions.open(
            account.name, account.role, account.account_id, "password"
        )
        return self.admit(request, cookie, Response(status_code=204))

    def admit(self, request: Request, cookie: str, response: Response) -> Response:
        """Give a browser its session, and note it in the audit."""
        principal = self.sessions.find(cookie)
        if principal is not None:
            self.attempts.note(principal, "sign_in", request)
        secure = request.url.scheme == "https"
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
        if before is not None and before.session is not None:
            self.sessions.end(before.session)

    # --- identification ---------------------------------------------------------

    def identify(self, connection: HTTPConnection) -> Principal | None:
        """The owner of the cookie or bearer token; None for a stranger."""
        scheme, _, token = connection.headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer":
            if same_secret(token.strip(), self._credentials.api_token):
                return PROGRAM
            return self.people.program(token.strip())
        secure = connection.scope["scheme"] in ("https", "wss")
        cookie = connection.cookies.get(session_cookie(secure=secure))
        return None if cookie is None else self.sessions.find(cookie)

    def authorise(self, request: Request, action: Action) -> Principal:
        """Authorise a request, and return its caller.

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
        if request.method not in READING:
            # Only cookies are sent by browsers on behalf of other sites.
            if principal.session is None:
                refuse_other_bodies(request)
            else:
                refuse_forgery(request)
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
        if (origin is not None or by_cookie) and not _is_own(origin, websocket):
            raise WebSocketException(FOREIGN_ORIGIN)
        if principal is None or not principal.may("read"):
            # A browser that asked for a subprotocol takes no handshake without one.
            await websocket.accept(
                next(iter(websocket.scope.get("subprotocols", ())), None)
            )
            raise WebSocketException(NO_SESSION)
        return principal


# --- requests of other sites' pages -----------------------------------------------


def refuse_forgery(request: Request) -> None:
    """Refuse a request without the two signs of our own page, or not as JSON.

    Cookies come with the requests of any site.  Browsers send Sec-Fetch-Site to
    trustworthy addresses only, so over plain HTTP in a greenhouse Origin must do.

    Raises:
        ForeignOriginError: one of them is missing or another site's.
        NotJsonError: a body that is not declared as JSON.
    """
    if request.headers.get("x-iveg") != "1":
        raise ForeignOriginError("header X-IVEG: 1")
    site = request.headers.get("sec-fetch-site")
    if site is None:
        own = _is_own(request.headers.get("origin"), request)
    else:
        own = site in ("same-origin", "none")
    if not own:
        raise ForeignOriginError("same origin")
    refuse_other_bodies(request)


def refuse_other_bodies(request: Request) -> None:
    """Refuse bodies that are not JSON: forms of other sites can send anything else.

    Raises:
        NotJsonError: a body that is not declared as JSON.
    """
    content_type = request.headers.get("content-type")
    if content_type is None:
        has_body = request.headers.get("content-length", "0") != "0"
        if has_body or "transfer-encoding" in request.headers:
            raise NotJsonError
    elif content_type.partition(";")[0].strip().lower() != "application/json":
        raise NotJsonError


def _is_own(origin: str | None, connection: HTTPConnection) -> bool:
    """Whether a page of this very server sent the request.

    Only host and port are compared: behind a proxy the scheme differs.
    """
    host = connection.headers.get("host", "")
    try:
        place = urlsplit(origin or "").netloc
    except ValueError:
        return False  # such as brackets that do not close
    return bool(host) and place.lower() == host.lower()
