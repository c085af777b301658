"""The sign-in link of earlier versions, for one version more: a token in the query.

It is taken off the URL before anything can log it.  Links now carry the token behind
``#``, where no server and no proxy sees it; the page posts it (``POST /signin``).
"""

from collections.abc import Callable
from urllib.parse import parse_qs

from starlette.requests import Request
from starlette.responses import Response
from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.web.problems import Problem
from iveg.web.security.authentication import Authenticator


class SignInLink:
    """Takes the token off ``GET /?token=…`` before anything can log or keep it.

    Args:
        authenticator: Where the token is looked at.
        refusal: Draws the page for a wrong token; None answers a problem.
    """

    def __init__(
        self,
        app: ASGIApp,
        authenticator: Authenticator,
        refusal: Callable[[Request, Problem], Response] | None = None,
    ) -> None:
        self._app = app
        self._authenticator = authenticator
        self._refusal = refusal

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        token = _token_in_link(scope)
        if token is None:
            await self._app(scope, receive, send)
            return
        # Servers write the query into their access log after the answer.
        scope["query_string"] = b""
        request = Request(scope)
        response = self._authenticator.follow_link(request, token)
        if isinstance(response, Problem):
            refuse = self._refusal or (lambda _, problem: problem.response())
            response = refuse(request, response)
        await response(scope, receive, send)


def _token_in_link(scope: Scope) -> str | None:
    if scope["type"] != "http" or scope["path"] != "/" or scope["method"] != "GET":
        return None
    query: bytes = scope["query_string"]
    return parse_qs(query.decode("latin-1")).get("token", [None])[0]
