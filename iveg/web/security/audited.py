"""Reads requests and their answers for the audit, as ``audited_routes`` says.

Which requests the audit keeps, and what of each (SECURITY.md, "Audit").

Every route that changes something has a row here; a test walks the routes.  Of a body
only the named keys are kept: the rest may be a password, or long.
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
    """What is kept of one route.

    Attributes:
        action: Its word in the audit; empty: the route writes its rows itself.
        subject: The parameter of the path that names what it was done to.
        asked: Keys of the body that are kept; ``answered`` of the answer.
        by_store: A change and its row are one transaction of the store; here only what
            was refused is written.
    """

    action: str
    subject: str = ""
    asked: tuple[str, ...] = ()
    answered: tuple[str, ...] = ()
    by_store: bool = False


_COMMAND: Final = ("command_id",)
_RULE: Final = (*by_keys(Parameters()), "aliases")
_API: Final = "/api/v1"
AUDITED: Final[Mapping[tuple[str, str], Audited]] = {
    ("POST", f"{_API}/robots/{{robot_id}}/stop"): Audited(
        "stop", "robot_id", ("press_id", "pressed_at"), _COMMAND
    ),
    ("POST", f"{_API}/fleet/stop"): Audited(
        "stop", asked=("press_id", "pressed_at"), answered=("commands",)
    ),
    ("POST", f"{_API}/robots/{{robot_id}}/release"): Audited(
        "release", "robot_id", ("holds",), _COMMAND
    ),
    ("POST", f"{_API}/robots/{{robot_id}}/resume"): Audited(
        "resume", "robot_id", answered=_COMMAND
    ),
    ("POST", f"{_API}/robots/{{robot_id}}/goal"): Audited(
        "goal", "robot_id", ("kind", "x", "y", "aisle"), ("goal_id",)
    ),
    ("DELETE", f"{_API}/robots/{{robot_id}}/goal"): Audited(
        "cancel_goal", "robot_id", answered=("goal_id",)
    ),
    ("PUT", f"{_API}/robots/{{robot_id}}/detector"): Audited(
        "detector", "robot_id", ("in_service", "reason")
    ),
    ("PUT", f"{_API}/words"): Audited("word", asked=("detector", "word", "is_person")),
    ("POST", f"{_API}/alerts/{{alert_id}}/acknowledge"): Audited(
        "acknowledge", "alert_id", ("note",), ("key", "robot_id")
    ),
    ("POST", f"{_API}/alerts/acknowledge"): Audited(
        "acknowledge", asked=("alert_ids", "note"), answered=("left",)
    ),
    ("PUT", f"{_API}/rule"): Audited(
        "rule",
        asked=("version", *_RULE),
        answered=("version",),
    ),
    ("POST", f"{_API}/rule/trial"): Audited("trial", asked=_RULE),
    ("DELETE", f"{_API}/rule/trial"): Audited("trial_ended"),
    ("POST", f"{_API}/rule/trial/promote"): Audited(
        "trial_promoted", asked=("version",), answered=("version",)
    ),
    ("POST", f"{_API}/notes"): Audited(
        "note", asked=("text", "at", "x", "y", "robot_id", "decision_id")
    ),
    ("POST", f"{_API}/things"): Audited("mark_thing", "", ("person_id",), ("id",)),
    ("DELETE", f"{_API}/things/{{thing_id}}"): Audited("unmark_thing", "thing_id"),
    ("POST", f"{_API}/users"): Audited(
        "account_added", asked=("name", "role", "days"), by_store=True
    ),
    ("PUT", f"{_API}/users/{{user_id}}/role"): Audited(
        "account_role", "user_id", ("role",), by_store=True
    ),
    ("POST", f"{_API}/users/{{user_id}}/reset"): Audited(
        "account_reset", "user_id", by_store=True
    ),
    ("POST", f"{_API}/users/{{user_id}}/disable"): Audited(
        "account_disabled", "user_id", by_store=True
    ),
    ("PUT", f"{_API}/account/password"): Audited("password_changed", by_store=True),
    ("PUT", f"{_API}/account/language"): Audited("language", asked=("language",)),
    ("POST", f"{_API}/tokens"): Audited(
        "token_added", asked=("name", "scope", "days"), by_store=True
    ),
    ("DELETE", f"{_API}/tokens/{{token_id}}"): Audited(
        "token_revoked", "token_id", by_store=True
    ),
    **{
        ("DELETE", f"{_API}{place}/sessions/{{session_id}}"): Audited(
            "session_ended", "session_id", answered=("name",)
        )
        for place in ("", "/account")
    },
    **{
        ("DELETE", f"{_API}{place}/sessions"): Audited(
            "sessions_ended", answered=("ended",)
        )
        for place in ("", "/account")
    },
    ("POST", "/signin"): Audited(""),
    ("POST", "/signout"): Audited("sign_out"),
    ("POST", "/wall"): Audited("wall"),
}
"""Method and path of a route → what is kept."""


_MOST_BYTES: Final = 16 * 1024
"""Of a body that is read; a longer one leaves its row without it."""
_FILES: Final = frozenset(
    {"text/csv", "application/x-ndjson", "application/zip", "application/vnd.mcap"}
)
"""Answers that leave iVeg to be kept."""
READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing."""


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
        reads = scope["method"] in READING
        # Before it is served: who signs out is nobody afterwards.
        who = None if reads else self._identify(HTTPConnection(scope))
        asked, answered = bytearray(), bytearray()
        start: Message = {"status": 500, "headers": ()}

        async def hear() -> Message:
            message = await receive()
            asked.extend(message.get("body", b""))
            return message

        async def answer(message: Message) -> None:
            if message["type"] == "http.response.start":
                start.update(message)
            elif not reads:
                answered.extend(message.get("body", b""))
            await send(message)

        try:
            await self._app(scope, receive if reads else hear, answer)
        finally:
            if reads:
                self._write_export(scope, start)
            elif who is not None:
                # Strangers change nothing; a sign-in writes its row itself.
                self._write_change(who, scope, start["status"], asked, answered)

    def _write_export(self, scope: Scope, start: Message) -> None:
        media_type = Headers(raw=start["headers"]).get("content-type", "")
        if start["status"] != 200 or media_type.partition(";")[0] not in _FILES:
            return
        who = self._identify(HTTPConnection(scope))
        if who is not None:
            asked = {"query": scope["query_string"].decode("latin-1")[:1000]}
            path = clean_text(scope["path"])
            self._trail.note(who, "export", path, asked, at=self._clock())

    def _write_change(
        self,
        who: Principal,
        scope: Scope,
        status: int,
        body: bytearray,
        answer: bytearray,
    ) -> None:
        path: str = getattr(scope.get("route"), "path", "")
        kept = AUDITED.get((scope["method"], path))
        if kept is None or not kept.action or (kept.by_store and status < 400):
            return
        asked, answered = _named(body, kept.asked), _named(answer, kept.answered)
        # What was seen stays beside what came of it.
        seen = {f"{name}_seen": asked[name] for name in asked.keys() & answered.keys()}
        details = {"status": status, **asked, **answered, **seen}
        subject = clean_text(str(scope["path_params"].get(kept.subject, "")))
        self._trail.note(who, kept.action, subject, details, at=self._clock())


def _named(body: bytearray, names: Sequence[str]) -> dict[str, object]:
    """Some members of a JSON object; none of what is no such object."""
    read: object = None
    if names and len(body) <= _MOST_BYTES:
        with suppress(UnreadableError):
            read = load_json(bytes(body))
    known = read if isinstance(read, dict) else {}
    return {name: all_legible(known[name]) for name in names if name in known}
