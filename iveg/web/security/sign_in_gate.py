"""The gate before all sign-ins together: a flood of them takes little of the loop.

A limit by address alone is none for who has many, and each request that is looked at
costs the loop on which a STOP runs some milliseconds.
"""

from typing import Final

from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.pipeline.ports import Clock
from iveg.web.problem import Problem
from iveg.web.security.rate_limits import Allowance

PASS_PER_S: Final = 20.0
"""As many as one thread can compute."""
_SIGN_IN: Final = "/signin"


class SignInGate:
    """Refuses (429) sign-ins beyond twenty a second before anything looks at them."""

    def __init__(self, app: ASGIApp, clock: Clock) -> None:
        self._app, self._clock = app, clock
        self._allowance = Allowance(PASS_PER_S, clock().mono)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if (
            scope["type"] == "http"
            and scope["method"] == "POST"
            and scope["path"] == _SIGN_IN
            and not self._allowance.admit(self._clock().mono)
        ):
            detail = "Too many sign in at once; try again in a moment."
            headers = {"Retry-After": "2", "Connection": "close"}
            refusal = Problem(429, detail, "busy", headers=headers).response()
            await refusal(scope, receive, send)
            return
        await self._app(scope, receive, send)
