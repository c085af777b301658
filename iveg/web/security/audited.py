"""Which requests the audit keeps, and what of each (SECURITY.md, "Audit").

Every route that changes something has a row here; a test walks the routes.  Of a body
only the named keys are kept: the rest may be a password, or long.
"""

from collections.abc import Callable, Iterable, Mapping
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
from iveg.web.security.roles import Principal

_KEPT_BYTES = 16 * 1024
_FILES: Final = frozenset(
    {"text/csv", "application/x-ndjson", "application/zip", "application/vnd.mcap"}
)
"""Answers that leave iVeg to be kept."""
READING: Final = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing."""


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
_RULE: Final = (
    "confidence_threshold",
    "class_thresholds",
    "radius_m",
    "aliases",
    "foresight",
    "foresight_s",
)
_API: Final = "/api/v1"
AUDITED: Final[Mapping[tuple[str, str], Audited]] = {
    ("POST", f"{_API}/robots/{{robot_id}}/stop"): Audited(
        "stop", "robot_id", ("press_id", "pressed_at"), _COMMAND
    ),
    ("POST", f"{_API}/fleet/stop"): Audited(
        "stop", asked=("press_id", "pressed_at"), answered=("commands",)
    ),
    ("POST", f"{_API}/robots/{{robot_id}}/drill"): Audited(
        "drill", "robot_id", answered=_COMMAND
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
        "detector", "robot_id", ("in_service",)
    ),
    ("POST", f"{_API}/robots/{{robot_id}}/revoke"): Audited(
        "robot_revoked", "robot_id", answered=("revoked", "broker")
    ),
    ("POST", f"{_API}/robots/{{robot_id}}/allow"): Audited(
        "robot_allowed", "robot_id", answered=("broker",)
    ),
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
    ("POST", f"{_API}/what-if"): Audited(
        "what_if", asked=("since", "until", *_RULE, "vary"), answered=("id",)
    ),
    ("DELETE", f"{_API}/what-if/{{job_id}}"): Audited("what_if_ended", "job_id"),
    ("POST", f"{_API}/notes"): Audited(
        "note", asked=("text", "at", "x", "y", "robot_id", "decision_id")
    ),
    ("POST", f"{_API}/things"): Audited(
        "mark_thing", "", ("person_id", "robot_id"), ("id",)
    ),
    ("DELETE", f"{_API}/things/{{thing_id}}"): Audited("unmark_thing", "thing_id"),
    ("PUT", f"{_API}/messages/email"): Audited(
        "messages_email", asked=("on", "server", "port", "security", "least")
    ),
    ("PUT", f"{_API}/messages/webhook"): Audited(
        "messages_webhook", asked=("on", "who", "least")
    ),
    ("PUT", f"{_API}/messages/push"): Audited("messages_push", asked=("on",)),
    ("POST", f"{_API}/messages/devices"): Audited("messages_device", asked=("who",)),
    ("DELETE", f"{_API}/messages/devices/{{device_id}}"): Audited(
        "messages_device_removed", "device_id"
    ),
    ("POST", f"{_API}/messages/{{channel}}/test"): Audited("messages_test", "channel"),
    ("POST", f"{_API}/experiments"): Audited("experiment", asked=("size",)),
    ("POST", f"{_API}/experiments/stop"): Audited("experiment_stopped"),
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
    ("POST", f"{_API}/account/proof"): Audited("proof"),
    ("PUT", f"{_API}/account/pin"): Audited("pin_changed", by_store=True),
    ("DELETE", f"{_API}/account/pin"): Audited("pin_removed", by_store=True),
    ("POST", f"{_API}/tablet"): Audited("tablet", asked=("name",)),
    ("POST", f"{_API}/tablet/unlock"): Audited(
        "tablet_unlocked",
        asked=("person_id",),
        answered=("holder", "left", "blocked_s"),
    ),
    ("POST", f"{_API}/tablet/lock"): Audited("tablet_locked"),
    ("POST", f"{_API}/account/passkeys"): Audited(
        "passkey_added", asked=("name",), by_store=True
    ),
    ("DELETE", f"{_API}/account/passkeys/{{passkey_id}}"): Audited(
        "passkey_removed", "passkey_id", by_store=True
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
