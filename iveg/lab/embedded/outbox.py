"""From a change to its notifications."""

import itertools
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from urllib.parse import urlsplit

from iveg.lab.embedded.entities import Entity, Touched
from iveg.lab.embedded.http_requests import (
    AGENT,
    NotificationTarget,
    with_length,
    write_head,
)
from iveg.lab.embedded.notifier import Delivery, DeliveryLane
from iveg.lab.embedded.orion_text import quoted
from iveg.lab.embedded.subscription_documents import SubscriptionDocument
from iveg.lab.embedded.subscriptions import Subscription
from iveg.lab.embedded.views import write_entity


class Outbox:
    """Writes notifications and passes them to one lane for each subscription.

    Args:
        now: Returns Unix time, for the moment of a response.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._routes: dict[str, _Route] = {}
        self._correlators = itertools.count(1)
        self._prefix = f"{secrets.token_hex(4)}-e4ec-11f1-9a0b-"

    def correlator(self) -> str:
        """Correlator of one chain of requests."""
        return f"{self._prefix}{next(self._correlators):012x}"

    def post(
        self,
        subscription: Subscription,
        entity: Entity,
        touched: Touched,
        alteration: str,
        correlator: str,
        now: float,
    ) -> None:
        """Send one entity to one subscriber."""
        notification = subscription.document.notification
        view = notification.shown(touched)
        body = write_entity(entity, view, alteration=alteration)
        if not view.form.startswith("simplified"):
            body = b'{"subscriptionId":%b,"data":[%b]}' % (
                quoted(subscription.id),
                body,
            )
        route = self._route(subscription)
        request = b"%bFiware-Correlator: %b; cbnotif=1\r\n%b" % (
            route.head,
            correlator.encode(),
            with_length(body),
        )
        subscription.sent(now)

        def done(status: int, answer: bytes | str) -> None:
            if status:
                subscription.succeeded(self._now(), status)
            else:
                subscription.failed(self._now(), str(answer))

        route.lane.send(Delivery(request, route.timeout_s, done))

    def _route(self, subscription: Subscription) -> "_Route":
        """Head and lane, made again only when the subscription changed."""
        known = self._routes.get(subscription.id)
        if known is not None and known.document is subscription.document:
            return known
        endpoint = subscription.document.notification.endpoint
        target = NotificationTarget.from_url(endpoint.url)
        if known is not None and known.target != target:
            self.forget(subscription.id)
            known = None
        made = self._routes[subscription.id] = _Route(
            subscription.document,
            _write_head(subscription),
            target,
            DeliveryLane(target) if known is None else known.lane,
            endpoint.timeout_s,
        )
        return made

    def forget(self, subscription_id: str) -> None:
        """Close the connection of a deleted or redirected subscription."""
        known = self._routes.pop(subscription_id, None)
        if known is not None:
            known.lane.close()

    def close(self) -> None:
        """Close every connection."""
        for subscription_id in list(self._routes):
            self.forget(subscription_id)


@dataclass(frozen=True, slots=True)
class _Route:
    """How the notifications of one version of a subscription are sent.

    Attributes:
        head: Constant part of the head.
        timeout_s: Time limit of a response (s).
    """

    document: SubscriptionDocument
    head: bytes
    target: NotificationTarget
    lane: DeliveryLane
    timeout_s: float


def _write_head(subscription: Subscription) -> bytes:
    notification = subscription.document.notification
    url = urlsplit(notification.endpoint.url)
    custom = {name.lower(): value for name, value in notification.headers.items()}
    headers = {
        "Host": url.netloc,
        "User-Agent": AGENT,
        "Fiware-Service": subscription.service,
        "Fiware-Servicepath": subscription.path,
        "Accept": "application/json",
        "Content-Type": "application/json; charset=utf-8",
        "Ngsiv2-AttrsFormat": notification.view.form,
    }
    own = {name: one for name, one in headers.items() if name.lower() not in custom}
    target = (url.path or "/") + (f"?{url.query}" if url.query else "")
    return write_head(target, {**own, **custom})
