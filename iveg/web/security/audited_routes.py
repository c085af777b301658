"""Which requests the audit keeps, and what of each (SECURITY.md, "Audit").

Every route that changes something has a row here; a test walks the routes.  Of a body
only the named keys are kept: the rest may be a password, or long.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final


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
