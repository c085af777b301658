"""From a change to its notifications."""

import itertools
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

import orjson

from iveg.lab.embedded.entities import Entity, Touched
from iveg.lab.embedded.notifier import Delivery, DeliveryLane, NotificationTarget
from iveg.lab.embedded.orion_text import quoted
from iveg.lab.embedded.subscriptions import Subscription
from iveg.lab.embedded.views import EntityView, annotated, write_entity

AGENT = "orion/4.7.0-next libcurl/7.88.1"
_MACRO = re.compile(r"\$\{([^}]*)\}")
_WHOLE_MACRO = re.compile(r'"\$\{([^}"]*)\}"')


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
        view = subscription.shown(touched)
        entity = annotated(entity, touched, view.metadata, alteration)
        body = self._body(subscription, entity, view, alteration)
        route = self._route(subscription)
        request = _write_request(route.head, entity, body, correlator)
        subscription.sent(now)

        def done(status: int, answer: bytes | str) -> None:
            if status:
                subscription.succeeded(self._now(), status)
            else:
                subscription.failed(self._now(), str(answer))

        route.lane.send(Delivery(request, subscription.timeout_s, done))

    def _body(
        self,
        subscription: Subscription,
        entity: Entity,
        view: EntityView,
        alteration: str,
    ) -> bytes:
        endpoint = subscription.endpoint
        if "payload" in endpoint:
            return _filled(endpoint["payload"], entity).encode()
        if "json" in endpoint:
            return _filled_json(endpoint["json"], entity)
        text = write_entity(entity, view, alteration=alteration)
        if view.form.startswith("simplified"):
            return text
        return b'{"subscriptionId":%b,"data":[%b]}' % (quoted(subscription.id), text)

    def _route(self, subscription: Subscription) -> "_Route":
        """Head and lane, made again only when the subscription changed."""
        known = self._routes.get(subscription.id)
        if known is not None and known.document is subscription.document:
            return known
        target = NotificationTarget.from_url(subscription.endpoint["url"])
        if known is not None and known.target != target:
            self.forget(subscription.id)
            known = None
        lane = DeliveryLane(target) if known is None else known.lane
        head = _write_head(subscription)
        made = _Route(subscription.document, head, target, lane)
        self._routes[subscription.id] = made
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
    """

    document: Mapping[str, Any]
    head: bytes
    target: NotificationTarget
    lane: DeliveryLane


def _write_request(head: bytes, entity: Entity, body: bytes, correlator: str) -> bytes:
    if b"${" in head:
        head = _filled(head.decode(), entity).encode()
    return b"%bContent-Length: %d\r\nFiware-Correlator: %b; cbnotif=1\r\n\r\n%b" % (
        head,
        len(body),
        correlator.encode(),
        body,
    )


def _write_head(subscription: Subscription) -> bytes:
    endpoint, view = subscription.endpoint, subscription.view
    custom = "httpCustom" in subscription.notification
    parts = urlsplit(endpoint["url"])
    query = "&".join(
        f"{name}={value}" for name, value in endpoint.get("qs", {}).items()
    )
    query = "&".join(part for part in (parts.query, query) if part)
    target = (parts.path or "/") + (f"?{query}" if query else "")
    kind = "text/plain" if "payload" in endpoint else "application/json; charset=utf-8"
    headers = {
        "Host": parts.netloc,
        "User-Agent": AGENT,
        "Fiware-Service": subscription.service,
        "Fiware-Servicepath": subscription.path,
        "Accept": "application/json",
        "Content-Type": kind,
        "Ngsiv2-AttrsFormat": (
            "custom" if "payload" in endpoint or "json" in endpoint else view.form
        ),
    }
    if custom:
        for name, value in endpoint.get("headers", {}).items():
            headers = {k: v for k, v in headers.items() if k.lower() != name.lower()}
            headers[name.lower()] = str(value)
    lines = [
        f"{endpoint.get('method', 'POST') if custom else 'POST'} {target} HTTP/1.1"
    ]
    lines += [f"{name}: {value}" for name, value in headers.items() if value]
    return "\r\n".join((*lines, "")).encode()


def _filled(text: str, entity: Entity) -> str:
    return _MACRO.sub(lambda found: _macro(found[1], entity).strip('"'), text)


def _filled_json(template: object, entity: Entity) -> bytes:
    text = orjson.dumps(template).decode()
    text = _WHOLE_MACRO.sub(lambda found: _macro(found[1], entity), text)
    return _filled(text, entity).encode()


def _macro(name: str, entity: Entity) -> str:
    """Value of ``${name}`` as JSON text."""
    if name in ("id", "type"):
        return quoted(getattr(entity, name)).decode()
    attribute = entity.attributes.get(name)
    return "null" if attribute is None else attribute.json.decode()
