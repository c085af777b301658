"""Reads requests and their answers for the audit, as ``audited_routes`` says."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Final

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.ngsi.codec import load_json
from iveg.ngsi.texts import all_legible, clean_text
from iveg.pipeline.audit import AuditTrail
from iveg.pipeline.ports import Clock
from iveg.web.security.audited_routes import AUDITED
from iveg.web.security.roles import Principal

_KEPT_BYTES = 16 * 1024
_FILES: Final = frozenset(
    {"text/csv", "application/x-ndjson", "application/zip", "application/vnd.mcap"}
)
"""Answers that leave iVeg to be kept."""
READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing."""


@dataclass(slots=True)
class _Exchange:
    """One request and its answer, as far as the audit needs them."""

    reads: bool
    asked: bytearray = field(default_factory=bytearray)
    answer: bytearray = field(default_factory=bytearray)
    status: int = 500
    is_file: bool = False

    def hear(self, message: Message) -> None:
        """A part of the request."""
        _keep(self.asked, message)

    def answered(self, message: Message) -> None:
        """A part of the answer."""
        if message["type"] == "http.response.start":
            self.status = message["status"]
            media_type = Headers(raw=message["headers"]).get("content-type", "")
            self.is_file = media_type.partition(";")[0] in _FILES
        elif not self.reads:
            _keep(self.answer, message)


class AuditRequests:
    """Writes down what people and programs change and export.

    Args:
        identify: Who sends a request; None for a stranger.
        trail: Takes the rows; never waits.
        clock: Read at each of them.
    """

    def __init__(
        self,
        app: ASGIApp,
        identify: Callable[[HTTPConnection], Principal | None],
        trail: AuditTrail,
        clock: Clock,
    ) -> None:
        self._app = app
        self._identify = identify
        self._trail = trail
        self._clock = clock

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        exchange = _Exchange(scope["method"] in READING)
        # Before it is served: who signs out is nobody afterwards.
        who = None if exchange.reads else self._identify(HTTPConnection(scope))

        async def hear() -> Message:
            message = await receive()
            exchange.hear(message)
            return message

        async def answer(message: Message) -> None:
            exchange.answered(message)
            await send(message)

        try:
            await self._app(scope, hear, answer)
        finally:
            if exchange.reads:
                self._write_export(scope, exchange)
            elif who is not None:
                # Strangers change nothing; a sign-in writes its row itself.
                self._write_change(who, scope, exchange)

    def _write_export(self, scope: Scope, exchange: _Exchange) -> None:
        if not exchange.is_file or exchange.status != 200:
            return
        who = self._identify(HTTPConnection(scope))
        if who is not None:
            asked = {"query": scope["query_string"].decode("latin-1")[:1000]}
            path = clean_text(scope["path"])
            self._trail.note(who, "export", path, asked, at=self._clock())

    def _write_change(self, who: Principal, scope: Scope, exchange: _Exchange) -> None:
        kept = AUDITED.get((scope["method"], path_of(scope)))
        if kept is None or not kept.action:
            return
        if kept.by_store and exchange.status < 400:
            return
        asked = _named(exchange.asked, kept.asked)
        answered = _named(exchange.answer, kept.answered)
        # What was seen stays beside what came of it.
        seen = {f"{name}_seen": asked[name] for name in asked.keys() & answered.keys()}
        details = {"status": exchange.status, **asked, **answered, **seen}
        subject = clean_text(str(scope["path_params"].get(kept.subject, "")))
        self._trail.note(who, kept.action, subject, details, at=self._clock())


def path_of(scope: Scope) -> str:
    """Path of the route that serves a request, with its parameters' names."""
    path: str = getattr(scope.get("route"), "path", "")
    return path


def _keep(kept: bytearray, message: Message) -> None:
    body: bytes = message.get("body", b"")
    if len(kept) + len(body) <= _KEPT_BYTES:
        kept += body


def _named(body: bytearray, names: Iterable[str]) -> dict[str, object]:
    """Some members of a JSON object; none of what is no such object."""
    if not names:
        return {}
    try:
        read = load_json(bytes(body))
    except UnreadableError:
        return {}
    if not isinstance(read, dict):
        return {}
    return {name: all_legible(read[name]) for name in names if name in read}
