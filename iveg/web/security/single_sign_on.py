"""Single sign-on: people whom an identity provider vouches for.

A browser goes to the provider and comes back with a code, which iVeg exchanges::

    begin ──> provider's page ──> finish ──> session, at most IVEG_SSO_HOURS
                                     └─────> refused: why, on the page and in the audit

``begin(anew=True)`` (``GET /signin/sso?anew=1&to=PATH``) has a person prove once more
who they are, and ``finish`` looks at ``auth_time``: what the session then tells as
``proven_at`` is the provider's word, and None where it gives none.
"""

import asyncio
import contextlib
import logging
import re
import secrets
from collections import OrderedDict
from collections.abc import Awaitable, Callable
from typing import Final, TypeVar

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from iveg.adapters.identity_provider import Attempt, IdentityProvider, Vouched
from iveg.domain.accounts import Account
from iveg.domain.audit import STRANGER, Actor, NamedActor
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.single_sign_on import ClaimReading, ProvenIdentity
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.ports import Clock
from iveg.web.security.authentication import Authenticator
from iveg.web.security.people import People
from iveg.web.security.rate_limits import REFUSED_ROWS, Allowance, FailedAttempts
from iveg.web.security.roles import Principal
from iveg.web.security.waiting_sign_ons import WAITS_S, WaitingSignOn, WaitingSignOns

CALLBACK: Final = "/signin/sso/callback"
_TOGETHER_S, _MOST_TOGETHER = 12.0, 8
_LEEWAY_S: Final = 30.0
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

    async def begin(
        self, request: Request, to: str = "/", *, anew: bool = False
    ) -> Response:
        """Send a browser to the provider.

        Args:
            request: Of the browser.
            to: Path of this server at which the person goes on; another is ``/``.
            anew: The person, who is signed in, must prove who they are once more.

        Raises:
            SignOnError: it cannot begin; the audit has it.
        """
        before = self._authenticator.identify(request)
        attempt = Attempt(f"{_base(request)}{CALLBACK}", anew=anew)
        try:
            if anew and (before is None or before.method != "sso"):
                raise SignOnError("not_renewed", "no session of the provider's")
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
            return await self._open(waiting, identity, vouched), waiting.to
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

    async def _open(
        self, waiting: WaitingSignOn, identity: ProvenIdentity, vouched: Vouched
    ) -> str:
        """Begin the session of somebody who was vouched for."""
        if waiting.attempt.anew:
            _check_renewed(waiting, identity)
        if identity.role is None:
            raise SignOnError("no_role", "none of the claim's values gives one")
        user = Account(
            identity.person, identity.name, identity.role, provider=self._issuer
        )
        try:
            account = await self._people.vouched(user)
        except HopError as error:
            raise SignOnError("unreachable", str(error)) from error
        sessions, now = self._authenticator.sessions, self._clock().wall
        if waiting.before is not None:
            sessions.revoke(waiting.before)
        proven = identity.auth_time
        token = sessions.open(
            account.name,
            account.role,
            account.account_id,
            "sso",
            until=now + self._lasts_s,
            proven=None if proven is None else min(proven, now),
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


def _check_renewed(waiting: WaitingSignOn, identity: ProvenIdentity) -> None:
    """Raise SignOnError unless the same person has just proved who they are."""
    if waiting.before is None or waiting.before.person != identity.person:
        raise SignOnError("not_renewed", "somebody else signed in")
    at = identity.auth_time
    if at is None or at < waiting.began.wall - _LEEWAY_S:
        raise SignOnError("not_renewed", "the provider does not say that they did")


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
