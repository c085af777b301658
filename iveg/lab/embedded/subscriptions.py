"""Subscriptions, and the state of their notifications."""

from collections.abc import Collection
from dataclasses import dataclass

from iveg.lab.embedded.documents import new_id, read_document
from iveg.lab.embedded.entities import Touched
from iveg.lab.embedded.errors import bad_request, parse_error
from iveg.lab.embedded.orion_dates import date_iso
from iveg.lab.embedded.subscription_documents import SubscriptionDocument


@dataclass(slots=True)
class Subscription:
    """One subscription and its counters.

    Attributes:
        document: The client's request, merged with its later changes.
        path: Service path of its entities.
        service: Tenant, as in the notification's header.
        status: ``active``, ``inactive`` or ``oneshot``; expiry is by the clock.
    """

    id: str
    document: SubscriptionDocument
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

    def concerns(self, entity_id: str, entity_type: str) -> bool:
        """Whether an entity is subscribed to."""
        entities = self.document.subject.entities
        return any(one.matches(entity_id, entity_type) for one in entities)

    def may_want(self, names: Collection[str]) -> bool:
        """Whether an update of these attributes can lead to a notification."""
        condition = self.document.subject.condition
        watched = condition.watched
        return condition.any_update or not watched or not watched.isdisjoint(names)

    def expired(self, now: float) -> bool:
        """Whether it has expired."""
        expires = self.document.expires
        return expires is not None and expires <= date_iso(now)

    def wants(self, touched: Touched, alteration: str, now: float) -> bool:
        """Whether a change is to be notified now.

        Throttling drops notifications that come too early; they are not sent later.
        """
        document, last = self.document, self.last_notification
        throttling = document.throttling
        if throttling and last is not None and now - last < throttling:
            return False
        if self.status == "inactive" or self.expired(now):
            return False
        return document.subject.condition.wants(touched, alteration)

    def change(self, raw: object) -> None:
        """Apply a ``PATCH``; each part in it replaces the old one completely.

        Raises:
            FiwareError: 400 or 501.
        """
        if not isinstance(raw, dict):
            raise parse_error()
        kept = self.document.model_dump(by_alias=True, exclude_unset=True)
        self.document = read_document(SubscriptionDocument, {**kept, **raw})
        if "status" in raw:
            self.status = self.document.status
            self.fails = 0

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
        limit = self.document.notification.max_fails_limit
        if limit is not None and self.fails > limit:
            self.status = "inactive"

    def show(self, now: float) -> dict[str, object]:
        """The subscription as a client gets it."""
        shown = self.document.show()
        if not self.document.throttling:
            shown.pop("throttling", None)
        counted = self.document.notification.show() | self._counters()
        status = "expired" if self.expired(now) else self.status
        return {"id": self.id, **shown, "notification": counted, "status": status}

    def _counters(self) -> dict[str, object]:
        """What became of the notifications; nothing is said of what never was."""
        counters = {
            "timesSent": self.times_sent,
            "lastNotification": _whole_seconds(self.last_notification),
            "lastSuccess": _whole_seconds(self.last_success),
            "lastSuccessCode": self.last_success_code,
            "lastFailure": _whole_seconds(self.last_failure),
            "lastFailureReason": self.last_failure_reason,
            "failsCounter": self.fails,
        }
        return {name: value for name, value in counters.items() if value}


def _whole_seconds(at: float | None) -> str | None:
    return None if at is None else date_iso(int(at))


def read_subscription(raw: object, service: str, path: str) -> Subscription:
    """Read a subscription from a ``POST``.

    Raises:
        FiwareError: 400 or 501.
    """
    if raw == {}:
        raise bad_request("empty payload")
    if not isinstance(raw, dict):
        raise parse_error()
    document = read_document(SubscriptionDocument, raw)
    return Subscription(new_id(), document, path, service, document.status)
