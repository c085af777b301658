"""Subscriptions, and their notifications by HTTP/1.1.

Each entity of a subscription has a lane: a queue and one connection, so that its
notifications keep their order.  A receiver takes one notification of a connection in a
turn of its loop: with one connection for ten robots at 30 Hz turns of more than 3 ms
would be too long, with ten connections turns of up to 33 ms are not.

Not by httpx: a post costs 1.5 ms of processor time there and 0.1 ms here, and ten
robots make 900 in a second.
"""

import asyncio
import logging
import re
import ssl
from collections import deque
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Literal, cast
from urllib.parse import urlsplit

import httptools
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeInt,
    ValidationError,
    model_validator,
)
from pydantic.alias_generators import to_camel

from iveg.lab.embedded.entities import (
    FORBIDDEN,
    Entity,
    EntityView,
    Touched,
    bad_request,
    date_iso,
    date_text,
    new_id,
    not_supported,
    quoted,
    write_entity,
)

_DEFAULT_TIMEOUT_MS = 5000
_LEFT_OUT = ("extra_forbidden", "literal_error")


class Document(BaseModel):
    """A document with no other fields than the supported ones, in camelCase."""

    model_config = ConfigDict(extra="forbid", frozen=True, alias_generator=to_camel)


def _read_description(text: str | None) -> str | None:
    if not FORBIDDEN.isdisjoint(text or ""):
        raise bad_request("forbidden characters in description")
    return text


def _read_date(text: str | None) -> str | None:
    return date_text(text).decode().strip('"') if text else None


def _read_url(text: str) -> str:
    parts = urlsplit(text)
    if parts.scheme not in ("http", "https") or not parts.hostname:
        raise bad_request("Invalid URL parsing notification url")
    return text


def _read_headers(headers: dict[str, str]) -> dict[str, str]:
    if any("${" in value for value in headers.values()):
        raise not_supported("a macro in a header")
    return headers


def _read_pattern(text: str | None) -> str | None:
    try:
        re.compile(text or "")
    except re.error:
        raise bad_request("Invalid regex for entity idPattern") from None
    return text


class SubscribedEntity(Document):
    """One entity, or those whose ids match a pattern."""

    id: str | None = None
    id_pattern: Annotated[str | None, AfterValidator(_read_pattern)] = None
    type: str | None = None

    @model_validator(mode="after")
    def _check(self) -> "SubscribedEntity":
        if self.id is None and self.id_pattern is None:
            raise bad_request("subject entities element has neither id nor idPattern")
        if self.id is not None and self.id_pattern is not None:
            raise bad_request("/entities/ vector item has both /id/ and /idPattern/")
        return self

    def matches(self, entity: Entity) -> bool:
        """Whether an entity is meant."""
        if self.type not in (None, entity.type):
            return False
        if self.id is not None:
            return self.id == entity.id
        return re.search(self.id_pattern or "", entity.id) is not None


class SubscriptionCondition(Document):
    """Changes that lead to a notification; of any attribute where none is named."""

    attrs: tuple[str, ...] = ()
    notify_on_metadata_change: Literal[True] = True

    @cached_property
    def watched(self) -> frozenset[str]:
        """Attributes that are watched; empty for all."""
        return frozenset(self.attrs)


class Subject(Document):
    """Entities, and their changes."""

    entities: list[SubscribedEntity] = Field(min_length=1)
    condition: SubscriptionCondition = SubscriptionCondition()


class Endpoint(Document):
    """The receiver of the notifications."""

    url: Annotated[str, AfterValidator(_read_url)]
    timeout: NonNegativeInt | None = None

    @property
    def timeout_s(self) -> float:
        """Time limit of a response (s)."""
        return (self.timeout or _DEFAULT_TIMEOUT_MS) / 1000


class CustomEndpoint(Endpoint):
    """A receiver that gets headers of its own."""

    headers: Annotated[dict[str, str], AfterValidator(_read_headers)] | None = None


class Notification(Document):
    """Content and receiver of the notifications."""

    attrs: tuple[str, ...] = ()
    only_changed_attrs: Literal[False] = False
    attrs_format: Literal["normalized", "keyValues"] = "normalized"
    http: Endpoint | None = None
    http_custom: CustomEndpoint | None = None
    covered: Literal[False] = False

    @model_validator(mode="after")
    def _check(self) -> "Notification":
        if self.http is None and self.http_custom is None:
            raise bad_request(
                "http, httpCustom, mqtt, mqttCustom, kafka or kafkaCustom is missing"
            )
        return self

    @property
    def endpoint(self) -> Endpoint:
        """The receiver."""
        return next(one for one in (self.http, self.http_custom) if one is not None)

    @property
    def headers(self) -> Mapping[str, str]:
        """Headers that the receiver asked for."""
        custom = self.http_custom
        return (custom.headers if custom else None) or {}

    @cached_property
    def view(self) -> EntityView:
        """Representation of an entity in the notification."""
        return EntityView(self.attrs, self.attrs_format == "keyValues")


class SubscriptionDocument(Document):
    """What a client says of a subscription, with Orion's defaults."""

    description: Annotated[str | None, AfterValidator(_read_description)] = None
    subject: Subject
    notification: Notification
    expires: Annotated[str | None, AfterValidator(_read_date)] = None
    status: Literal["active", "inactive"] = "active"


def _read(raw: object) -> SubscriptionDocument:
    try:
        return SubscriptionDocument.model_validate(raw)
    except ValidationError as error:
        complaints = error.errors()
        left_out = [one for one in complaints if one["type"] in _LEFT_OUT]
        first = (left_out or complaints)[0]
        place = "/".join(map(str, first["loc"]))
        if left_out:
            raise not_supported(place) from error
        raise bad_request(f"{place}: {first['msg']}") from error


@dataclass(slots=True)
class Subscription:
    """One subscription and its counters.

    Attributes:
        document: The client's request, merged with its later changes.
        path: Service path of its entities.
        service: Tenant, as in the notification's header.
    """

    id: str
    document: SubscriptionDocument
    path: str
    service: str
    times_sent: int = 0
    last_notification: float | None = None
    last_success: float | None = None
    last_success_code: int = 0
    last_failure: float | None = None
    last_failure_reason: str = ""
    fails: int = 0

    def concerns(self, entity: Entity) -> bool:
        """Whether an entity is subscribed to."""
        return self.path == entity.path and any(
            one.matches(entity) for one in self.document.subject.entities
        )

    def may_want(self, names: Collection[str]) -> bool:
        """Whether an update of these attributes can lead to a notification."""
        watched = self.document.subject.condition.watched
        return not watched or not watched.isdisjoint(names)

    def status(self, now: float) -> str:
        """``active``, ``inactive`` or ``expired``."""
        expires = self.document.expires
        if expires is not None and expires <= date_iso(now):
            return "expired"
        return self.document.status

    def wants(self, touched: Touched, now: float) -> bool:
        """Whether a change is to be notified now."""
        if self.status(now) != "active":
            return False
        watched = self.document.subject.condition.watched
        return any(touched.has_changed(name) for name in watched or touched.now)

    def change(self, raw: Mapping[str, object]) -> None:
        """Apply a ``PATCH``; each part in it replaces the old one completely.

        Raises:
            FiwareError: 400 or 501.
        """
        kept = self.document.model_dump(by_alias=True, exclude_unset=True)
        self.document = _read({**kept, **raw})
        if "status" in raw:
            self.fails = 0

    def sent(self, now: float) -> None:
        """Count a notification that was sent."""
        self.times_sent += 1
        self.last_notification = now

    def succeeded(self, now: float, status: int) -> None:
        """Record a response of the receiver; any status counts as success."""
        self.last_success, self.last_success_code, self.fails = now, status, 0

    def failed(self, now: float, reason: str) -> None:
        """Record a missing response."""
        self.last_failure, self.last_failure_reason = now, reason
        self.fails += 1

    def show(self, now: float) -> dict[str, object]:
        """The subscription as a client gets it."""
        shown = self.document.model_dump(by_alias=True, exclude_none=True)
        notification = shown["notification"] | self._counters()
        told = {"notification": notification, "status": self.status(now)}
        return {"id": self.id, **shown, **told}

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


def read_subscription(
    raw: Mapping[str, object], service: str, path: str
) -> Subscription:
    """Read a subscription from a ``POST``.

    Raises:
        FiwareError: 400 or 501.
    """
    return Subscription(new_id(), _read(raw), path, service)


_log = logging.getLogger(__name__)
MOST_WAITING = 300
"""Of one lane: ten seconds of one kind of a robot's measures at 30 Hz."""
MOST_AHEAD = 4
"""Requests on a kept connection before their responses: a busy receiver answers one in
a turn of its loop then, and one in two turns without."""
IDLE_S = 2.0
"""A connection that was idle for longer is not used again: Node.js closes after 5 s."""

REFUSED = "Couldn't connect to server"
TIMED_OUT = "Timeout was reached"
CLOSED = "Server returned nothing (no headers, no data)"


class Outbox:
    """The lanes of all subscriptions.

    Args:
        now: Returns Unix time (s), for the moment of a response.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self._now = now
        self._lanes: dict[str, dict[object, Lane]] = {}

    def post(self, subscription: Subscription, entity: Entity, now: float) -> None:
        """Send one entity to one subscriber."""
        lanes = self._lanes.setdefault(subscription.id, {})
        lane = lanes.get(entity.key)
        if lane is None or lane.document is not subscription.document:
            if lane is not None:
                lane.close()
            lane = lanes[entity.key] = Lane(subscription, self._now)
        body = b'{"subscriptionId":%b,"data":[%b]}' % (
            quoted(subscription.id),
            write_entity(entity, subscription.document.notification.view),
        )
        subscription.sent(now)
        lane.send(body)

    def forget(self, subscription_id: str) -> None:
        """Close the connections of a subscription; what waits is lost."""
        for lane in self._lanes.pop(subscription_id, {}).values():
            lane.close()

    def close(self) -> None:
        """Close every connection."""
        for subscription_id in list(self._lanes):
            self.forget(subscription_id)


class Lane:
    """A queue and one connection to a receiver, in order.

    Args:
        subscription: Whose notifications it sends; told of each outcome.
        now: Returns Unix time (s).

    Attributes:
        document: The version of the subscription that it serves.
    """

    def __init__(self, subscription: Subscription, now: Callable[[], float]) -> None:
        self.document = subscription.document
        self._endpoint = self.document.notification.endpoint
        self._head = _write_head(subscription)
        self._subscription = subscription
        self._now = now
        self._waiting: deque[bytes] = deque()
        self._is_overflowing = False
        self._connection: _Connection | None = None
        self._under_way = 0
        self._patience: asyncio.TimerHandle | None = None
        """Ends what is under way where no response comes."""

    def send(self, body: bytes) -> None:
        """Queue one notification; of a full queue the oldest gives way."""
        if len(self._waiting) >= MOST_WAITING:
            self._waiting.popleft()
            self._subscription.failed(self._now(), TIMED_OUT)
            if not self._is_overflowing:
                _log.warning("%s reads too slowly: oldest dropped", self._endpoint.url)
                self._is_overflowing = True
        self._waiting.append(body)
        self._send_next()

    def close(self) -> None:
        """Close the connection; what waits is lost."""
        self._waiting.clear()
        self._hang_up()

    def end(self, connection: "_Connection", status: int, reason: str = "") -> None:
        """Take a response, or the end of a connection, and send what waits.

        Args:
            connection: Where it came from.
            status: That of the response; 0 for none.
            reason: In place of a response, in libcurl's words.
        """
        if connection is not self._connection:
            return
        if status and self._under_way:
            self._under_way -= 1
            self._subscription.succeeded(self._now(), status)
        self._stop_patience()
        if not (status and connection.is_kept):
            for _ in range(self._under_way):
                self._subscription.failed(self._now(), reason or CLOSED)
            self._hang_up()
        self._send_next()

    def _send_next(self) -> None:
        loop = asyncio.get_running_loop()
        while self._waiting:
            connection = self._connection_to_use(loop.time())
            if self._under_way >= (MOST_AHEAD if connection.is_kept else 1):
                break
            body = self._waiting.popleft()
            length = b"Content-Length: %d\r\n\r\n" % len(body)
            connection.send(self._head + length + body)
            self._under_way += 1
        if self._is_overflowing and not self._waiting:
            _log.warning("%s has caught up", self._endpoint.url)
            self._is_overflowing = False
        if self._under_way and self._patience is None:
            self._patience = loop.call_later(self._endpoint.timeout_s, self._time_out)

    def _time_out(self) -> None:
        if self._connection is not None:
            self.end(self._connection, 0, TIMED_OUT)

    def _connection_to_use(self, now: float) -> "_Connection":
        connection = self._connection
        is_idle = connection is not None and not self._under_way
        if connection is None or (is_idle and now - connection.used_at > IDLE_S):
            self._hang_up()
            connection = self._connection = _Connection(self, self._endpoint.url)
        return connection

    def _hang_up(self) -> None:
        self._stop_patience()
        self._under_way = 0
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _stop_patience(self) -> None:
        if self._patience is not None:
            self._patience.cancel()
            self._patience = None


class _Connection(asyncio.Protocol):
    """One connection of a lane, which it tells each response.

    Attributes:
        is_kept: Whether the receiver keeps it after the last response.
        used_at: Time of the last response (loop time, s).
    """

    def __init__(self, lane: Lane, url: str) -> None:
        self._lane = lane
        self._parser = httptools.HttpResponseParser(self)
        self._transport: asyncio.Transport | None = None
        self._request = b""
        self.is_kept = False
        loop = asyncio.get_running_loop()
        self.used_at = loop.time()
        self._opening = loop.create_task(self._open(url), name="embedded-notifications")

    async def _open(self, url: str) -> None:
        parts = urlsplit(url)
        context = ssl.create_default_context() if parts.scheme == "https" else None
        port = parts.port or (443 if context else 80)
        try:
            await asyncio.get_running_loop().create_connection(
                lambda: self, parts.hostname or "", port, ssl=context
            )
        except OSError:
            self._lane.end(self, 0, REFUSED)

    def send(self, request: bytes) -> None:
        """Send a request, at the latest when it is open."""
        if self._transport is None:
            self._request = request
        else:
            self._transport.write(request)

    def close(self) -> None:
        """Close it at once."""
        self._opening.cancel()
        if self._transport is not None:
            self._transport.abort()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Connected."""
        self._transport = cast("asyncio.Transport", transport)
        self._transport.write(self._request)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's
        """Either side closed it."""
        self._lane.end(self, 0, CLOSED)

    def data_received(self, data: bytes) -> None:
        """Part of a response."""
        try:
            self._parser.feed_data(data)
        except httptools.HttpParserError:
            self._lane.end(self, 0, CLOSED)

    def on_message_complete(self) -> None:
        """A response is complete, unless it only promises one."""
        status = self._parser.get_status_code()
        if status >= 200:
            self.is_kept = self._parser.should_keep_alive()
            self.used_at = asyncio.get_running_loop().time()
            self._lane.end(self, status)


def _write_head(subscription: Subscription) -> bytes:
    """The part of a request's head that does not change; no header is empty."""
    notification = subscription.document.notification
    url = urlsplit(notification.endpoint.url)
    custom = {name.lower(): value for name, value in notification.headers.items()}
    headers = {
        "host": url.netloc,
        "user-agent": "orion/4.7.0-next libcurl/7.88.1",
        "fiware-service": subscription.service,
        "fiware-servicepath": subscription.path,
        "accept": "application/json",
        "content-type": "application/json; charset=utf-8",
        "ngsiv2-attrsformat": notification.attrs_format,
    }
    target = (url.path or "/") + (f"?{url.query}" if url.query else "")
    lines = [
        f"{name}: {value}" for name, value in {**headers, **custom}.items() if value
    ]
    return "\r\n".join((f"POST {target} HTTP/1.1", *lines, "")).encode()
