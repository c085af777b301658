"""Single sign-on: people whom an identity provider vouches for.

A browser goes to the provider and comes back with a code, which iVeg exchanges::

    begin ──> provider's page ──> finish ──> session, at most IVEG_SSO_HOURS
                                     └─────> refused: why, on the page and in the audit

Sign-ins that are at the identity provider: which answers are awaited, and whose.
"""

import asyncio
import contextlib
import logging
import re
import secrets
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final, TypeVar

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from iveg.adapters.identity_provider import Attempt, IdentityProvider, Vouched
from iveg.domain.accounts import Account, ClaimReading, ProvenIdentity
from iveg.domain.audit import STRANGER, Actor, NamedActor
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.observations import Instant
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.security.authentication import Authenticator
from iveg.web.security.people import People
from iveg.web.security.rate_limits import REFUSED_ROWS, Allowance, FailedAttempts
from iveg.web.security.roles import Principal

WAITS_S: Final = 600.0
_MOST, _MOST_OF_ADDRESS = 1000, 16


@dataclass(frozen=True, slots=True)
class WaitingSignOn:
    """A sign-in that was sent to the provider.

    Attributes:
        browser: What the browser's own cookie says, so that nobody ends the sign-in of
            somebody else in their browser.
        to: Path at which the person goes on.
        before: Whose session the browser had.
    """

    attempt: Attempt
    browser: str
    address: str
    to: str
    began: Instant
    before: Principal | None


class WaitingSignOns:
    """Bounded: the oldest gives way, that of the same address first."""

    def __init__(self) -> None:
        self._waiting: OrderedDict[str, WaitingSignOn] = OrderedDict()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, one: WaitingSignOn) -> None:
        """Await the answer to one more."""
        same = [
            state
            for state, other in self._waiting.items()
            if other.address == one.address
        ]
        if len(same) >= _MOST_OF_ADDRESS:
            del self._waiting[same[0]]
        elif len(self._waiting) >= _MOST:
            self._waiting.popitem(last=False)
        self._waiting[one.attempt.state] = one

    def pop(self, state: str, browser: str, now: Instant) -> WaitingSignOn | None:
        """The sign-in that an answer belongs to, once; None: to none any more."""
        one = self._waiting.get(state)
        if one is None or one.browser != browser or not browser:
            # Another browser's answer: the sign-in goes on to wait for its own.
            return None
        del self._waiting[state]
        return one if now.mono - one.began.mono < WAITS_S else None


CALLBACK: Final = "/signin/sso/callback"
_TOGETHER_S, _MOST_TOGETHER = 12.0, 8
_MOST_HINTS: Final = 1000
_OWN_PATH: Final = re.compile(r"/(?![/\\])[!-\[\]-~]{0,500}")
_MOST_CODE: Final = 4096
_T = TypeVar("_T")
_log = logging.getLogger(__name__)


class SingleSignOn:
    """Signs people in by an identity provider.

    Args:
        provider: Vouches for them.
        reading: Where name and role stand in what it says.
        people: Keeps their accounts.
        authenticator: Keeps their sessions.
        clock: Read at each question.
        trail: Told of sign-ins, and of those that were refused.
        lasts_s: How long a session lasts (s).
    """

    def __init__(
        self,
        provider: IdentityProvider,
        reading: ClaimReading,
        people: People,
        authenticator: Authenticator,
        clock: Clock,
        trail: AuditTrail,
        lasts_s: float,
    ) -> None:
        self._provider, self._reading = provider, reading
        self._issuer = provider.client.issuer
        self._people, self._authenticator = people, authenticator
        self._clock, self._trail, self._lasts_s = clock, trail, lasts_s
        self._waiting = WaitingSignOns()
        self._wrong = FailedAttempts()
        self._rows = Allowance(REFUSED_ROWS, clock().mono)
        self._hints: OrderedDict[bytes, str] = OrderedDict()
        self._together = 0

    # --- to the provider and back -------------------------------------------------

    async def begin(self, request: Request, to: str = "/") -> Response:
        """Send a browser to the provider.

        Args:
            request: Of the browser.
            to: Path of this server at which the person goes on; another is ``/``.

        Raises:
            SignOnError: it cannot begin; the audit has it.
        """
        before = self._authenticator.identify(request)
        attempt = Attempt(f"{_base(request)}{CALLBACK}")
        try:
            address = await self._bounded(lambda: self._provider.address(attempt))
        except SignOnError as error:
            self._refused(request, error, before or STRANGER)
            raise
        browser = request.cookies.get(_cookie(request), "")
        if not re.fullmatch(r"[\w-]{43}", browser):
            browser = secrets.token_urlsafe(32)
        to = to if _OWN_PATH.fullmatch(to) else "/"
        now, client = self._clock(), _client(request)
        self._waiting.put(WaitingSignOn(attempt, browser, client, to, now, before))
        response = RedirectResponse(address, 303)
        # Lax: the way back begins at the provider, where Strict cookies stay behind.
        secure = request.url.scheme == "https"
        response.set_cookie(
            _cookie(request),
            browser,
            max_age=int(WAITS_S),
            path="/",
            secure=secure,
            httponly=True,
            samesite="lax",
        )
        return response

    async def finish(self, request: Request) -> tuple[str, str]:
        """Take a browser in that comes from the provider.

        Returns:
            The token of the new session, and the path at which the person goes on.

        Raises:
            SignOnError: it lets nobody in; the audit has it.
        """
        who: Actor = STRANGER
        try:
            waiting = self._awaited(request)
            vouched = await self._bounded(lambda: self._vouched(request, waiting))
            identity = self._reading.read(self._issuer, vouched.subject, vouched.claims)
            who = _actor(identity)
            return self._open(waiting, identity, vouched), waiting.to
        except SignOnError as error:
            self._refused(request, error, who)
            raise

    def _awaited(self, request: Request) -> WaitingSignOn:
        """The sign-in that a browser brings the answer to."""
        now, client = self._clock(), _client(request)
        if self._wrong.wait_s(client, now.mono) > 0.0:
            raise SignOnError("busy", "too many wrong answers from there")
        state = request.query_params.get("state", "")
        cookie = request.cookies.get(_cookie(request), "")
        waiting = self._waiting.pop(state, cookie, now)
        if waiting is None:
            self._wrong.failed(client, now.mono)
            raise SignOnError("outdated", "no sign-in of this browser waits for it")
        return waiting

    async def _vouched(self, request: Request, waiting: WaitingSignOn) -> Vouched:
        query = request.query_params
        if "error" in query:
            raise SignOnError("refused", _plain(query["error"]))
        # RFC 9207: an answer of somebody else's, where it says whose it is.
        if query.get("iss", self._issuer) != self._issuer:
            raise SignOnError("untrusted", "the answer is another issuer's")
        code = query.get("code", "")
        if not 0 < len(code) <= _MOST_CODE:
            raise SignOnError("untrusted", "the answer holds no code")
        return await self._provider.vouch(waiting.attempt, code)

    def _open(
        self, waiting: WaitingSignOn, identity: ProvenIdentity, vouched: Vouched
    ) -> str:
        """Begin the session of somebody who was vouched for."""
        if identity.role is None:
            raise SignOnError("no_role", "none of the claim's values gives one")
        user = Account(
            identity.person, identity.name, identity.role, provider=self._issuer
        )
        account = self._people.vouched(user)
        sessions, now = self._authenticator.sessions, self._clock().wall
        if waiting.before is not None:
            sessions.revoke(waiting.before)
        token = sessions.open(
            account.name,
            account.role,
            account.account_id,
            "sso",
            until=now + self._lasts_s,
        )
        self._keep_hint(sessions.find(token), vouched.id_token)
        return token

    # --- away from it -------------------------------------------------------------

    async def sign_out_address(self, request: Request, who: Principal) -> str | None:
        """Where somebody signs out at the provider, too; None: nowhere.

        Waits for a provider that hangs no longer than for any other.
        """
        if who.method != "sso" or who.session is None:
            return None
        hint = self._hints.pop(who.session, "")
        back = f"{_base(request)}/signin"
        with contextlib.suppress(HopError, TimeoutError):
            async with asyncio.timeout(_TOGETHER_S):
                return await self._provider.sign_out_address(back, hint)
        return None

    async def close(self) -> None:
        """Close the connections to the provider."""
        await self._provider.close()

    # --- small pieces -------------------------------------------------------------

    async def _bounded(self, ask: Callable[[], Awaitable[_T]]) -> _T:
        """Ask the provider, few at a time and not for long."""
        if self._together >= _MOST_TOGETHER:
            raise SignOnError("busy", "too many sign in at once")
        self._together += 1
        try:
            async with asyncio.timeout(_TOGETHER_S):
                return await ask()
        except TimeoutError as error:
            raise SignOnError("unreachable", "it takes too long") from error
        except HopError as error:
            raise SignOnError("unreachable", error.detail) from error
        finally:
            self._together -= 1

    def _keep_hint(self, who: Principal | None, id_token: str) -> None:
        if who is None or who.session is None or not id_token:
            return
        if len(self._hints) >= _MOST_HINTS:
            self._hints.popitem(last=False)
        self._hints[who.session] = id_token

    def _refused(self, request: Request, error: SignOnError, who: Actor) -> None:
        now = self._clock()
        if not self._rows.admit(now.mono):
            return
        _log.warning("sign-in by the provider refused: %s", error)
        details = {
            "address": _client(request),
            "by": "sso",
            "why": error.failure,
            "detail": error.detail,
        }
        self._trail.note(who, "sign_in_refused", details=details, at=now)


def _actor(identity: ProvenIdentity) -> Actor:
    return NamedActor(
        identity.person, identity.name, identity.role or "stranger", "sso"
    )


def _plain(text: str) -> str:
    """An OAuth error code as it may be logged."""
    return re.sub(r"[^\w.-]", "?", text[:40], flags=re.ASCII)


def _base(request: Request) -> str:
    return str(request.base_url).rstrip("/")


def _client(request: Request) -> str:
    return "" if request.client is None else request.client.host


def _cookie(request: Request) -> str:
    return "__Host-iveg-sso" if request.url.scheme == "https" else "iveg-sso"
