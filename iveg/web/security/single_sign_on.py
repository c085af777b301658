"""Single sign-on: people whom an identity provider vouches for.

A browser goes to the provider and comes back with a code, which iVeg exchanges::

    begin ──> provider's page ──> finish ──> session, at most IVEG_SSO_HOURS
                                     └─────> refused: why, on the page and in the audit
"""

import asyncio
import contextlib
import logging
import re
import secrets
from collections import OrderedDict
from collections.abc import AsyncIterator
from dataclasses import dataclass
from typing import Final

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from iveg.adapters.identity_provider import Attempt, IdentityProvider, Vouched
from iveg.domain.accounts import Account, ClaimReading, ProvenIdentity
from iveg.domain.audit import STRANGER, Actor, NamedActor
from iveg.domain.errors import HopError, SignOnError
from iveg.web.security.attempts import FailedAttempts, client_of
from iveg.web.security.authentication import Authenticator
from iveg.web.security.roles import Principal

CALLBACK: Final = "/signin/sso/callback"
WAITS_S: Final = 600.0
_MOST, _MOST_OF_ADDRESS, _MOST_HINTS = 1000, 16, 1000
_TOGETHER_S, _MOST_TOGETHER = 12.0, 8
_OWN_PATH: Final = re.compile(r"/(?![/\\])[!-\[\]-~]{0,500}")
_MOST_CODE: Final = 4096
_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class WaitingSignOn:
    """A sign-in that was sent to the provider.

    Attributes:
        browser: What the browser's own cookie says, so that nobody ends the sign-in of
            somebody else in their browser.
        to: Path at which the person goes on.
        until: When nobody waits for it any more (monotonic, s).
        before: Whose session the browser had.
    """

    attempt: Attempt
    browser: str
    address: str
    to: str
    until: float
    before: Principal | None


class SingleSignOn:
    """Signs people in by an identity provider.

    Args:
        provider: Vouches for them.
        reading: Where name and role stand in what it says.
        authenticator: Keeps their accounts and sessions.
        lasts_s: How long a session lasts (s).
    """

    def __init__(
        self,
        provider: IdentityProvider,
        reading: ClaimReading,
        authenticator: Authenticator,
        lasts_s: float,
    ) -> None:
        self._provider, self._reading = provider, reading
        self._authenticator, self._lasts_s = authenticator, lasts_s
        self._issuer = provider.client.issuer
        self._clock = authenticator.people.clock
        self._waiting: OrderedDict[str, WaitingSignOn] = OrderedDict()
        self._wrong = FailedAttempts()
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
            async with self._asking():
                address = await self._provider.address(attempt)
        except SignOnError as error:
            self._note_refused(request, error, before or STRANGER)
            raise
        browser = request.cookies.get(_cookie(request), "")
        if not re.fullmatch(r"[\w-]{43}", browser):
            browser = secrets.token_urlsafe(32)
        to = to if _OWN_PATH.fullmatch(to) else "/"
        until, client = self._clock().mono + WAITS_S, client_of(request)
        self._await(WaitingSignOn(attempt, browser, client, to, until, before))
        response = RedirectResponse(address, 303)
        # Lax: the way back begins at the provider, where Strict cookies stay behind.
        response.set_cookie(
            _cookie(request),
            browser,
            max_age=int(WAITS_S),
            path="/",
            secure=request.url.scheme == "https",
            httponly=True,
            samesite="lax",
        )
        return response

    def _await(self, sign_on: WaitingSignOn) -> None:
        """Await one more; the oldest gives way, that of the same address first."""
        waiting = self._waiting
        address = sign_on.address
        same = [state for state in waiting if waiting[state].address == address]
        if len(same) >= _MOST_OF_ADDRESS:
            del waiting[same[0]]
        elif len(waiting) >= _MOST:
            waiting.popitem(last=False)
        waiting[sign_on.attempt.state] = sign_on

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
            code = self._code(request)
            async with self._asking():
                vouched = await self._provider.vouch(waiting.attempt, code)
            proven = self._reading.read(self._issuer, vouched.subject, vouched.claims)
            role = proven.role or "stranger"
            who = NamedActor(proven.person, proven.name, role, "sso")
            return self._open(waiting, proven, vouched), waiting.to
        except SignOnError as error:
            self._note_refused(request, error, who)
            raise

    def _awaited(self, request: Request) -> WaitingSignOn:
        """The sign-in that a browser brings the answer to, once."""
        now, client = self._clock().mono, client_of(request)
        if self._wrong.wait_s(client, now) > 0.0:
            raise SignOnError("busy", "too many wrong answers from there")
        state = request.query_params.get("state", "")
        found = self._waiting.get(state)
        # Another browser's answer: the sign-in goes on to wait for its own.
        if found is not None and found.browser == request.cookies.get(_cookie(request)):
            del self._waiting[state]
            if now < found.until:
                return found
        self._wrong.failed(client, now)
        raise SignOnError("outdated", "no sign-in of this browser waits for it")

    def _code(self, request: Request) -> str:
        """The code in an answer of the provider."""
        query = request.query_params
        if "error" in query:
            # An OAuth error code as it may be logged.
            why = re.sub(r"[^\w.-]", "?", query["error"][:40], flags=re.ASCII)
            raise SignOnError("refused", why)
        # RFC 9207: an answer of somebody else's, where it says whose it is.
        if query.get("iss", self._issuer) != self._issuer:
            raise SignOnError("untrusted", "the answer is another issuer's")
        code = query.get("code", "")
        if not 0 < len(code) <= _MOST_CODE:
            raise SignOnError("untrusted", "the answer holds no code")
        return code

    def _open(
        self, waiting: WaitingSignOn, proven: ProvenIdentity, vouched: Vouched
    ) -> str:
        """Begin the session of somebody who was vouched for."""
        if proven.role is None:
            raise SignOnError("no_role", "none of the claim's values gives one")
        by = NamedActor(proven.person, proven.name, proven.role, "sso")
        account = self._authenticator.people.admission(by).vouched(
            Account(proven.person, proven.name, proven.role, provider=self._issuer)
        )
        sessions = self._authenticator.sessions
        if waiting.before is not None:
            sessions.revoke(waiting.before)
        token = sessions.open(
            account.name,
            account.role,
            account.account_id,
            "sso",
            until=self._clock().wall + self._lasts_s,
        )
        who = sessions.find(token)
        if who is not None and who.session is not None and vouched.id_token:
            if len(self._hints) >= _MOST_HINTS:
                self._hints.popitem(last=False)
            self._hints[who.session] = vouched.id_token
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

    # --- small pieces -------------------------------------------------------------

    @contextlib.asynccontextmanager
    async def _asking(self) -> AsyncIterator[None]:
        """A question to the provider: few at a time, and not for long."""
        if self._together >= _MOST_TOGETHER:
            raise SignOnError("busy", "too many sign in at once")
        self._together += 1
        try:
            async with asyncio.timeout(_TOGETHER_S):
                yield
        except TimeoutError as error:
            raise SignOnError("unreachable", "it takes too long") from error
        except HopError as error:
            raise SignOnError("unreachable", error.detail) from error
        finally:
            self._together -= 1

    def _note_refused(self, request: Request, error: SignOnError, who: Actor) -> None:
        facts = {"by": "sso", "why": error.failure, "detail": error.detail}
        if self._authenticator.attempts.note_refused(who, request, **facts):
            _log.warning("sign-in by the provider refused: %s", error)


def _base(request: Request) -> str:
    return str(request.base_url).rstrip("/")


def _cookie(request: Request) -> str:
    return "__Host-iveg-sso" if request.url.scheme == "https" else "iveg-sso"
