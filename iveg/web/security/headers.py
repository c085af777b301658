"""Headers and the size limit in front of every route.

Pure ASGI.  Notifications come hundreds of times a second and no browser reads their
answers, so their path passes untouched; their route has the same limit.
"""

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iveg.web.problems import Problem

MAX_BODY = 1_048_576
"""1 MiB, as at Orion (bytes)."""
TOO_LONG = f"A body may have {MAX_BODY} bytes at most."

NOTIFICATIONS_PATH = "/ngsi/notifications"

CONTENT_SECURITY_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "font-src 'self'; connect-src 'self'; manifest-src 'self'; base-uri 'none'; "
    "form-action 'self'; frame-ancestors 'none'; object-src 'none'; "
    "require-trusted-types-for 'script'"
)
"""Policy of every page; figures are drawn under it, too."""

_ALWAYS = (
    ("content-security-policy", CONTENT_SECURITY_POLICY),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
)
_TLS = ("strict-transport-security", "max-age=31536000")


class Bounds:
    """Adds the headers of SECURITY.md, and refuses a body over the limit.

    A header that a response has set itself stays.  A body whose length is declared is
    refused before it is read.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http" or scope["path"] == NOTIFICATIONS_PATH:
            await self._app(scope, receive, send)
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                _guard(MutableHeaders(scope=message), scope)
            await send(message)

        declared = Headers(scope=scope).get("content-length", "")
        if declared.isdecimal() and int(declared) > MAX_BODY:
            # The unread body would be taken for the next request.
            problem = Problem(413, TOO_LONG, headers={"Connection": "close"})
            await problem.response()(scope, receive, send_guarded)
        else:
            await self._app(scope, _counted(receive), send_guarded)


def _guard(headers: MutableHeaders, scope: Scope) -> None:
    for name, value in _ALWAYS:
        headers.setdefault(name, value)
    # Files are checked at each load (mostly 304), so that a page never runs with
    # yesterday's scripts; everything else is somebody's data.
    is_file = scope["path"].startswith("/static/")
    headers.setdefault("cache-control", "no-cache" if is_file else "no-store")
    if scope["scheme"] == "https":
        headers.setdefault(*_TLS)


def _counted(receive: Receive) -> Receive:
    size = 0

    async def receive_counted() -> Message:
        nonlocal size
        message = await receive()
        size += len(message.get("body", b""))
        # A chunked body declares no length, so its bytes are counted.
        if size > MAX_BODY:
            raise HTTPException(413, TOO_LONG)
        return message

    return receive_counted
