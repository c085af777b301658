"""Single sign-on: people whom an identity provider vouches for.

A browser goes to the provider and comes back with a code, which iVeg exchanges::

    begin ──> provider's page ──> finish ──> session, at most 12 h
                                     └─────> refused: why, on the page and in the audit

An attempt waits in a sealed cookie of the browser that began it; the server keeps none.
"""

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator
from typing import Final

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from iveg.adapters.identity_provider import (
    WAITS_S,
    Attempt,
    IdentityProvider,
    SealedAttempts,
)
from iveg.domain.accounts import Account, ClaimReading
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.wire import clean_text
from iveg.web.security.authentication import Authenticator
from iveg.web.security.secrets import same_secret

CALLBACK: Final = "/signin/sso/callback"
_MOST_TOGETHER = 8
_OWN_PATH: Final = re.compile(r"/(?![/\\])[!-\[\]-~]{0,500}")


class SingleSignOn:
    """Signs people in by an identity provider.

    Args:
        provider: Vouches for them.
        reading: Where name and role stand in what it says.
        authenticator: Keeps their accounts and sessions.
    """

    def __init__(
        self,
        provider: IdentityProvider,
        reading: ClaimReading,
        authenticator: Authenticator,
    ) -> None:
        self._provider, self._reading = provider, reading
        self._authenticator = authenticator
        self._clock = authenticator.people.clock
        self._attempts = SealedAttempts()
        self._exchanges = asyncio.Semaphore(_MOST_TOGETHER)

    async def begin(self, request: Request, to: str = "/") -> Response:
        """Send a browser to the provider.

        Args:
            request: Of the browser.
            to: Path of this server at which the person goes on; another is ``/``.

        Raises:
            SignOnError: it cannot begin; the audit has it.
        """
        back = f"{str(request.base_url).rstrip('/')}{CALLBACK}"
        attempt = Attempt(back, to if _OWN_PATH.fullmatch(to) else "/")
        try:
            async with self._asking():
                address = await self._provider.address(attempt)
        except SignOnError as error:
            self._note_refused(request, error)
            raise
        response = RedirectResponse(address, 303)
        # Lax: the way back begins at the provider, where Strict cookies stay behind.
        response.set_cookie(
            _cookie(request),
            self._attempts.seal(attempt, self._clock().wall),
            max_age=WAITS_S,
            path="/",
            secure=request.url.scheme == "https",
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
        try:
            attempt = self._attempt(request)
            code = _code(request)
            async with self._asking():
                vouched = await self._provider.vouch(attempt, code)
            issuer = self._provider.client.issuer
            told = self._reading.read(issuer, vouched.subject, vouched.claims)
            return self._open(told), attempt.to
        except SignOnError as error:
            self._note_refused(request, error)
            raise

    def _attempt(self, request: Request) -> Attempt:
        """The attempt of this browser to which the answer belongs."""
        sealed = request.cookies.get(_cookie(request), "")
        state = request.query_params.get("state", "")
        attempt = self._attempts.open(sealed, self._clock().wall)
        if attempt is None or not same_secret(state, attempt.state):
            raise SignOnError("outdated", "no sign-in of this browser waits for it")
        return attempt

    def _open(self, told: Account) -> str:
        """Begin the session of a person who was vouched for; returns its token."""
        by = Actor(told.name, told.role, told.account_id, "sso")
        account = self._authenticator.people.admission(by).vouched(told)
        return self._authenticator.sessions.open(
            account.name, account.role, account.account_id, "sso"
        )

    @contextlib.asynccontextmanager
    async def _asking(self) -> AsyncIterator[None]:
        """Questions to the provider: of few people at a time, each bounded in time."""
        if self._exchanges.locked():
            raise SignOnError("busy", "too many sign in at once")
        try:
            async with self._exchanges:
                yield
        except HopError as error:
            raise SignOnError("unreachable", error.detail) from error

    def _note_refused(self, request: Request, error: SignOnError) -> None:
        facts = {"by": "sso", "why": error.failure, "detail": error.detail}
        self._authenticator.attempts.note_refused(request, **facts)


def _code(request: Request) -> str:
    """The code in an answer of the provider."""
    query = request.query_params
    if "error" in query:
        raise SignOnError("refused", clean_text(query["error"][:40]))
    code = query.get("code")
    if not code:
        raise SignOnError("untrusted", "the answer holds no code")
    return code


def _cookie(request: Request) -> str:
    return "__Host-iveg-sso" if request.url.scheme == "https" else "iveg-sso"
