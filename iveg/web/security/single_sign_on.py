"""Single sign-on by an identity provider that vouches for people.

A browser goes to the provider and comes back with a code, which iVeg exchanges::

    begin ──> provider's page ──> finish ──> session, at most 12 h
                                     └─────> refused: why, on the page and in the audit

An attempt waits in a sealed cookie of the browser that began it; the server keeps none.
"""

import asyncio
import contextlib
import re
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Final

from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from iveg.adapters.identity_provider import WAITS_S, Attempt, SealedAttempts
from iveg.domain.accounts import ClaimReading
from iveg.domain.audit import Actor
from iveg.domain.errors import HopError, SignOnError
from iveg.domain.wire import clean_text
from iveg.web.security.authentication import Authenticator
from iveg.web.security.secrets import same_secret

if TYPE_CHECKING:
    from iveg.adapters.oidc import OpenIdProvider

CALLBACK: Final = "/signin/sso/callback"
_MOST_TOGETHER = 8
_OWN_PATH: Final = re.compile(r"/(?![/\\])[!-\[\]-~]{0,500}")


class SingleSignOn:
    """Signs people in by an identity provider.

    Args:
        provider: Vouches for them.
        reading: Finds name and role in its claims.
        authenticator: Keeps their accounts and sessions.
    """

    def __init__(
        self,
        provider: "OpenIdProvider",
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
            request: The browser's request.
            to: Path of this server at which the person goes on; other text counts as
                ``/``.

        Raises:
            SignOnError: it cannot begin, which is noted in the audit.
        """
        return_url = f"{str(request.base_url).rstrip('/')}{CALLBACK}"
        attempt = Attempt(return_url, to if _OWN_PATH.fullmatch(to) else "/")
        async with self._asking(request):
            address = await self._provider.address(attempt)
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
        """Sign in a browser that comes back from the provider.

        Returns:
            The token of the new session, and the path at which the person goes on.

        Raises:
            SignOnError: nobody is let in, which is noted in the audit.
        """
        async with self._asking(request):
            attempt, code = self._answer(request)
            claims = await self._provider.vouch(attempt, code)
            vouched = self._reading.read(claims["iss"], claims["sub"], claims)
            actor = Actor(vouched.name, vouched.role, vouched.account_id, "sso")
            account = self._authenticator.people.admission(actor).vouched(vouched)
        token = self._authenticator.sessions.open(
            account.name, account.role, account.account_id, "sso"
        )
        return token, attempt.to

    def _answer(self, request: Request) -> tuple[Attempt, str]:
        """The attempt of this browser that the provider answers, and its code."""
        query = request.query_params
        sealed = request.cookies.get(_cookie(request), "")
        attempt = self._attempts.open(sealed, self._clock().wall)
        if attempt is None or not same_secret(query.get("state", ""), attempt.state):
            raise SignOnError("outdated", "no sign-in of this browser waits for it")
        if "error" in query:
            raise SignOnError("refused", clean_text(query["error"][:40]))
        if not query.get("code"):
            raise SignOnError("untrusted", "the answer holds no code")
        return attempt, query["code"]

    @contextlib.asynccontextmanager
    async def _asking(self, request: Request) -> AsyncIterator[None]:
        """Questions to the provider, of few people at a time; failures are audited.

        Raises:
            SignOnError: nobody is let in.
        """
        try:
            # Refused, not queued: a provider that answers nothing takes 5 s a question.
            if self._exchanges.locked():
                raise SignOnError("busy", "too many sign in at once")
            async with self._exchanges:
                yield
        except (HopError, SignOnError) as error:
            reason = error.failure if isinstance(error, SignOnError) else "unreachable"
            facts = {"by": "sso", "why": reason, "detail": error.detail}
            self._authenticator.attempts.note_refused(request, **facts)
            raise SignOnError(reason, error.detail) from error


def _cookie(request: Request) -> str:
    return "__Host-iveg-sso" if request.url.scheme == "https" else "iveg-sso"
