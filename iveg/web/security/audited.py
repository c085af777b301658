"""Audit of requests that change or export something, from request and answer.

Every route that changes something has a row here; a test walks the routes.  Only the
named keys of a body are kept: the rest may be a password, or long.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from starlette.datastructures import Headers
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.domain.parameters import Parameters, by_keys
from iveg.domain.wire import all_legible, clean_text
from iveg.ngsi.codec import load_json
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web.security.roles import Principal


@dataclass(frozen=True, slots=True)
class Audited:
    """Parts of a route that are kept, beside the parameter of its path.

    Attributes:
        action: Its word in the audit; empty: the route writes its rows itself.
        sent: Members of the request's body that are kept.
        answered: Members of the answer that are kept.
    """

    action: str
    sent: tuple[str, ...]
    answered: tuple[str, ...]


# The book of accounts writes rows of such changes itself; here only refusals do.
_NOTED_BY_BOOK: Final = frozenset(
    {
        "account_added",
        "account_disabled",
        "account_reset",
        "account_role",
        "password_changed",
        "token_added",
        "token_revoked",
    }
)
_RULE: Final = " ".join((*by_keys(Parameters()), "aliases"))
_ROWS: Final[Mapping[str, str]] = {
    "POST /api/v1/robots/{robot_id}/stop": "stop press_id pressed_at > command_id",
    "POST /api/v1/fleet/stop": "stop press_id pressed_at > commands",
    "POST /api/v1/robots/{robot_id}/release": "release holds > command_id",
    "POST /api/v1/robots/{robot_id}/resume": "resume > command_id",
    "POST /api/v1/robots/{robot_id}/goal": "goal kind x y aisle > goal_id",
    "DELETE /api/v1/robots/{robot_id}/goal": "cancel_goal > goal_id",
    "PUT /api/v1/robots/{robot_id}/detector": "detector in_service reason",
    "PUT /api/v1/words": "word detector word is_person",
    "POST /api/v1/alerts/{alert_id}/acknowledge": "acknowledge note > key robot_id",
    "POST /api/v1/alerts/acknowledge": "acknowledge alert_ids note > left",
    "PUT /api/v1/rule": f"rule version {_RULE} > version",
    "POST /api/v1/rule/trial": f"trial {_RULE}",
    "DELETE /api/v1/rule/trial": "trial_ended",
    "POST /api/v1/rule/trial/promote": "trial_promoted version > version",
    "POST /api/v1/notes": "note text at x y robot_id decision_id",
    "POST /api/v1/things": "mark_thing person_id > id",
    "DELETE /api/v1/things/{thing_id}": "unmark_thing",
    "POST /api/v1/users": "account_added name role days",
    "PUT /api/v1/users/{user_id}/role": "account_role role",
    "POST /api/v1/users/{user_id}/reset": "account_reset",
    "POST /api/v1/users/{user_id}/disable": "account_disabled",
    "PUT /api/v1/account/password": "password_changed",
    "POST /api/v1/tokens": "token_added name scope days",
    "DELETE /api/v1/tokens/{token_id}": "token_revoked",
    "DELETE /api/v1/sessions/{session_id}": "session_ended > name",
    "DELETE /api/v1/account/sessions/{session_id}": "session_ended > name",
    "POST /signin": "",
    "POST /signout": "sign_out",
}
"""Method and path of a route → action, keys of the body > keys of the answer."""


def _read_row(row: str) -> Audited:
    before, _, after = row.partition(">")
    action, *sent = before.split() or [""]
    return Audited(action, tuple(sent), tuple(after.split()))


AUDITED: Final = {
    (method, path): _read_row(row)
    for route, row in _ROWS.items()
    for method, path in [route.split()]
}

_MOST_BYTES: Final = 16 * 1024
"""Largest body that is read; a longer one leaves its row without it."""
_FILES: Final = frozenset(
    {"text/csv", "application/x-ndjson", "application/zip", "application/vnd.mcap"}
)
"""Media types of files that leave iVeg: sending one is an export."""
READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing."""


class AuditRequests:
    """Records changes and exports of people and programs.

    Args:
        identify: Finds the sender of a request; None for a stranger.
        trail: Takes the rows; never waits.
        clock: Read at each row.
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
        reads = scope["method"] in READING
        # Before it is served: after a sign-out the caller would be unknown.
        who = None if reads else self._identify(HTTPConnection(scope))
        sent, answered = bytearray(), bytearray()
        start: Message = {"status": 500, "headers": ()}

        async def receive_kept() -> Message:
            message = await receive()
            sent.extend(message.get("body", b""))
            return message

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                start.update(message)
            elif not reads:
                answered.extend(message.get("body", b""))
            await send(message)

        try:
            await self._app(scope, receive if reads else receive_kept, answer)
        finally:
            # A failed route is on record, too: ``start`` has 500 by default.
            if reads:
                self._write_export(scope, start)
            elif who is not None:
                # Strangers change nothing; a sign-in writes its row itself.
                self._write_change(who, scope, start["status"], sent, answered)

    def _write_export(self, scope: Scope, start: Message) -> None:
        media_type = Headers(raw=start["headers"]).get("content-type", "")
        if start["status"] != 200 or media_type.partition(";")[0] not in _FILES:
            return
        principal = self._identify(HTTPConnection(scope))
        if principal is not None:
            query = {"query": scope["query_string"].decode("latin-1")[:1000]}
            path = clean_text(scope["path"])
            self._trail.note(principal, "export", path, query, at=self._clock())

    def _write_change(
        self,
        who: Principal,
        scope: Scope,
        status: int,
        body: bytearray,
        answer: bytearray,
    ) -> None:
        path: str = getattr(scope.get("route"), "path", "")
        row = AUDITED.get((scope["method"], path))
        if row is None or not row.action:
            return
        if row.action in _NOTED_BY_BOOK and status < 400:
            return
        sent, answered = _named(body, row.sent), _named(answer, row.answered)
        details = {"status": status, **sent, **answered}
        subject = clean_text("".join(map(str, scope["path_params"].values())))
        self._trail.note(who, row.action, subject, details, at=self._clock())


def _named(body: bytearray, names: Sequence[str]) -> dict[str, object]:
    """The named members of a JSON object; other values have none."""
    document: object = None
    if names and len(body) <= _MOST_BYTES:
        with suppress(UnreadableError):
            document = load_json(bytes(body))
    known = document if isinstance(document, dict) else {}
    return {name: all_legible(known[name]) for name in names if name in known}
