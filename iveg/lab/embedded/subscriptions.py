"""Subscriptions: which changes they match, and the state of their notifications."""

import re
import secrets
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any
from urllib.parse import urlsplit

from iveg.lab.embedded.entities import Touched
from iveg.lab.embedded.orion_text import (
    FORBIDDEN,
    bad_request,
    date_iso,
    date_text,
    not_supported,
    parse_error,
    read_pattern,
)
from iveg.lab.embedded.views import EntityView

FORMATS = (
    "normalized",
    "simplifiedNormalized",
    "keyValues",
    "simplifiedKeyValues",
    "values",
)
_FIELDS = {
    "description", "subject", "notification", "expires", "status", "throttling",
}  # fmt: skip
_ENDPOINTS = ("http", "httpCustom")
_UNSUPPORTED = ("mqtt", "mqttCustom", "kafka", "kafkaCustom")
_CONDITIONS_NOT_DONE = ("expression", "jexlExpression")
_ALTERATIONS = {"entityChange", "entityUpdate", "entityCreate", "entityDelete"}
_DEFAULT_TIMEOUT_S = 5.0
_Matcher = re.Pattern[str] | str


@dataclass(slots=True)
class Subscription:
    """One subscription and its counters.

    Attributes:
        document: The client's request, merged with its later changes.
        path: Service path of its entities.
        service: Tenant, as in the notification's header.
        status: ``active``, ``inactive`` or ``oneshot``; expiry is by the clock.
        notification: The part of that name in the document, as ``condition`` is.
        endpoint: The ``http`` or ``httpCustom`` part of the document.
        timeout_s: Time limit of a receiver's response (s).
    """

    id: str
    document: dict[str, Any]
    path: str
    service: str
    status: str = "active"
    times_sent: int = 0
    last_notification: float | None = None
    last_success: float | None = None
    last_success_code: int = 0
    last_failure: float | None = None
    last_failure_reason: str = ""
    fails: int = 0
    notification: dict[str, Any] = field(init=False)
    condition: dict[str, Any] = field(init=False)
    endpoint: dict[str, Any] = field(init=False)
    view: EntityView = field(init=False)
    timeout_s: float = field(init=False)
    _throttling: float = field(init=False)
    _watched: frozenset[str] = field(init=False)
    _metadata_too: bool = field(init=False)
    _any_update: bool = field(init=False)
    _only_changed: bool = field(init=False)
    _alterations: Collection[str] | None = field(init=False)
    _entities: list[tuple[_Matcher, _Matcher]] = field(init=False)

    def __post_init__(self) -> None:
        """Prepare the document for fast evaluation at every change."""
        self.prepare()

    def prepare(self) -> None:
        """Parse the document again after a change."""
        self.notification = notification = self.document["notification"]
        self.condition = condition = self.document["subject"].get("condition", {})
        self.endpoint = notification.get("http") or notification["httpCustom"]
        self.view = EntityView(
            notification.get("attrsFormat", "normalized"),
            tuple(notification.get("attrs", ())),
            tuple(notification.get("metadata", ())),
        )
        self._only_changed = bool(notification.get("onlyChangedAttrs"))
        self.timeout_s = self.endpoint.get("timeout", 0) / 1000 or _DEFAULT_TIMEOUT_S
        self._alterations = condition.get("alterationTypes")
        self._throttling = self.document.get("throttling", 0)
        self._watched = frozenset(condition.get("attrs") or ())
        self._metadata_too = condition.get("notifyOnMetadataChange", True)
        self._any_update = "entityUpdate" in (self._alterations or ())
        self._entities = [_matcher(one) for one in self.document["subject"]["entities"]]

    def concerns(self, entity_id: str, entity_type: str) -> bool:
        """Whether an entity is subscribed to."""
        return any(
            _matches(kind, entity_type) and _matches(name, entity_id)
            for name, kind in self._entities
        )

    def may_want(self, names: Collection[str]) -> bool:
        """Whether an update of these attributes can lead to a notification."""
        return (
            self._any_update or not self._watched or not self._watched.isdisjoint(names)
        )

    def expired(self, now: float) -> bool:
        """Whether it has expired."""
        expires: str = self.document.get("expires") or ""
        return bool(expires) and expires <= date_iso(now)

    def wants(self, touched: Touched, alteration: str, now: float) -> bool:
        """Whether a change is to be notified now.

        Throttling drops notifications that come too early; they are not sent later.
        """
        last = self.last_notification
        if self._throttling and last is not None and now - last < self._throttling:
            return False
        if self.status == "inactive" or self.expired(now):
            return False
        return self._alteration_wanted(alteration) and self._attributes_wanted(
            touched, alteration
        )

    def _alteration_wanted(self, alteration: str) -> bool:
        wanted = self._alterations
        if wanted is None:
            return alteration != "entityDelete"
        return alteration in wanted or (
            alteration == "entityChange" and "entityUpdate" in wanted
        )

    def _attributes_wanted(self, touched: Touched, alteration: str) -> bool:
        if alteration == "entityDelete" or (self._any_update and touched.now):
            return True
        watched = self._watched or touched.now
        return (not self._watched and alteration == "entityCreate") or any(
            touched.has_changed(name, metadata_too=self._metadata_too)
            for name in watched
        )

    def shown(self, touched: Touched) -> EntityView:
        """Attributes in the notification."""
        if not self._only_changed:
            return self.view
        names = self.view.names or touched.now
        chosen = tuple(name for name in names if touched.has_changed(name))
        return EntityView(self.view.form, chosen or ("",), self.view.metadata)

    def sent(self, now: float) -> None:
        """Count a notification that was sent."""
        self.times_sent += 1
        self.last_notification = now
        if self.status == "oneshot":
            self.status = "inactive"

    def succeeded(self, now: float, status: int) -> None:
        """Record a response of the receiver; any status counts as success."""
        self.last_success, self.last_success_code, self.fails = now, status, 0

    def failed(self, now: float, reason: str) -> None:
        """Record a missing response."""
        self.last_failure, self.last_failure_reason = now, reason
        self.fails += 1
        limit = self.notification.get("maxFailsLimit")
        if limit is not None and self.fails > limit:
            self.status = "inactive"

    def show(self, now: float) -> dict[str, Any]:
        """The subscription as a client gets it."""
        document, condition = self.document, self.condition
        shown = {
            "id": self.id,
            "description": document.get("description") or None,
            "expires": document.get("expires") or None,
            "status": "expired" if self.expired(now) else self.status,
            "subject": {
                "entities": document["subject"]["entities"],
                "condition": {
                    "attrs": [],
                    **condition,
                    "notifyOnMetadataChange": self._metadata_too,
                },
            },
            "notification": self._show_notification(),
            "throttling": document.get("throttling") or None,
        }
        return _without_none(shown)

    def _show_notification(self) -> dict[str, Any]:
        asked = self.notification
        shown = {
            "timesSent": self.times_sent or None,
            "lastNotification": _whole_seconds(self.last_notification),
            "attrs": asked.get("attrs", []),
            "onlyChangedAttrs": asked.get("onlyChangedAttrs", False),
            "attrsFormat": self.view.form,
            "http": asked.get("http"),
            "httpCustom": asked.get("httpCustom"),
            "metadata": asked.get("metadata"),
            "maxFailsLimit": asked.get("maxFailsLimit"),
            "lastFailure": _whole_seconds(self.last_failure),
            "lastFailureReason": self.last_failure_reason or None,
            "failsCounter": self.fails or None,
            "lastSuccess": _whole_seconds(self.last_success),
            "lastSuccessCode": self.last_success_code or None,
            "covered": asked.get("covered", False),
        }
        return _without_none(shown)


def _without_none(shown: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in shown.items() if value is not None}


def _whole_seconds(at: float | None) -> str | None:
    return None if at is None else date_iso(int(at))


@lru_cache(maxsize=256)
def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(text)


def _matcher(one: Mapping[str, str]) -> tuple[_Matcher, _Matcher]:
    name = one.get("id") or _pattern(one.get("idPattern", ".*"))
    kind = one.get("type") or _pattern(one.get("typePattern", ".*"))
    return name, kind


def _matches(matcher: _Matcher, text: str) -> bool:
    if isinstance(matcher, str):
        return matcher == text
    return matcher.search(text) is not None


# --- requests ---------------------------------------------------------------------


def new_id() -> str:
    """24 hexadecimal digits, as MongoDB names its documents."""
    return secrets.token_hex(12)


def read_subscription(raw: Any, service: str, path: str) -> Subscription:
    """Read a subscription from a ``POST``.

    Raises:
        NgsiError: 400, with Orion's sentence.
    """
    document = _read_document(raw)
    if not document:
        raise bad_request("empty payload")
    for part in ("subject", "notification"):
        if part not in document:
            raise bad_request(f"no {part} for subscription specified")
    status = document.pop("status", "active")
    return Subscription(new_id(), document, path, service, status)


def update_subscription(subscription: Subscription, raw: Any) -> None:
    """Apply a ``PATCH``; each part in it replaces the old one completely.

    Raises:
        NgsiError: 400, with Orion's sentence.
    """
    changes = _read_document(raw)
    status = changes.pop("status", None)
    subscription.document = {**subscription.document, **changes}
    if status is not None:
        subscription.status = status
        subscription.fails = 0
    subscription.prepare()


def _read_document(raw: Any) -> dict[str, Any]:
    if not isinstance(raw, dict):
        raise parse_error()
    document = dict(raw)
    if unknown := document.keys() - _FIELDS:
        raise bad_request(f"invalid field: {sorted(unknown)[0]}")
    if not FORBIDDEN.isdisjoint(str(document.get("description", ""))):
        raise bad_request("forbidden characters in description")
    if "subject" in document:
        _check_subject(document["subject"])
    if "notification" in document:
        document["notification"] = _read_notification(document["notification"])
    if document.get("expires"):
        document["expires"] = date_text(document["expires"]).decode().strip('"')
    if document.get("status", "active") not in ("active", "inactive", "oneshot"):
        raise bad_request(f"invalid status: {document['status']}")
    throttling = document.get("throttling", 0)
    if not isinstance(throttling, int) or throttling < 0:
        raise bad_request("throttling must be a non-negative integer")
    return document


def _check_subject(subject: Any) -> None:
    entities = subject.get("entities") if isinstance(subject, dict) else None
    if not isinstance(entities, list) or not entities:
        raise bad_request("no subject entities specified")
    for one in entities:
        if not isinstance(one, dict) or not ("id" in one or "idPattern" in one):
            raise bad_request("subject entities element has neither id nor idPattern")
        for name in ("id", "type"):
            if name in one and f"{name}Pattern" in one:
                raise bad_request(
                    f"/entities/ vector item has both /{name}/ and /{name}Pattern/"
                )
        for name in ("idPattern", "typePattern"):
            read_pattern(one.get(name, ".*"), name)
    _check_condition(subject.get("condition", {}))


def _check_condition(condition: Any) -> None:
    if not isinstance(condition, dict):
        raise bad_request("condition must be a JSON object")
    for name in _CONDITIONS_NOT_DONE:
        # Ignoring it would notify of every change.
        if name in condition:
            raise not_supported(f"condition/{name}")
    for one in condition.get("alterationTypes", []):
        if one not in _ALTERATIONS:
            raise bad_request(f"unknown alteration type: {one}")


def _read_notification(raw: Any) -> dict[str, Any]:
    if not isinstance(raw, dict):
        raise bad_request("notification must be a JSON object")
    chosen = [name for name in (*_ENDPOINTS, *_UNSUPPORTED) if name in raw]
    if not chosen:
        raise bad_request(
            "http, httpCustom, mqtt, mqttCustom, kafka or kafkaCustom is missing"
        )
    if chosen[0] in _UNSUPPORTED:
        raise bad_request(f"{chosen[0]} is not supported by the embedded broker")
    endpoint = raw[chosen[0]]
    url = endpoint.get("url", "") if isinstance(endpoint, dict) else ""
    parts = urlsplit(str(url))
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise bad_request("Invalid URL parsing notification url")
    form = raw.get("attrsFormat", "normalized")
    if form not in FORMATS:
        raise bad_request(
            "invalid attrsFormat, accepted values: normalized, simplifiedNormalized, "
            "keyValues, simplifiedkeyValues, values"
        )
    return dict(raw)
