"""Subscriptions, and their notifications by HTTP/1.1.

Each entity of a subscription has a lane: a queue, a task and one connection, so that
its notifications keep their order.

It does without httpx, where a post costs 1.1 ms of processor time: ten robots make 900
a second.
"""

import asyncio
import re
from collections.abc import Mapping, Set
from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeInt,
    PositiveInt,
    ValidationError,
    model_validator,
)
from pydantic.alias_generators import to_camel

from iveg.lab.embedded.entities import (
    FORBIDDEN,
    Entity,
    EntityView,
    bad_request,
    not_supported,
    write_entity,
)

_LEFT_OUT = ("extra_forbidden", "literal_error")


class Document(BaseModel):
    """A document with no other fields than the supported ones, in camelCase."""

    model_config = ConfigDict(extra="forbid", frozen=True, alias_generator=to_camel)


class SubscribedEntity(Document):
    """One entity, or those whose ids match a pattern."""

    id: str | None = None
    id_pattern: re.Pattern[str] | None = None
    type: str | None = None

    @model_validator(mode="after")
    def _check(self) -> "SubscribedEntity":
        if (self.id is None) == (self.id_pattern is None):
            raise bad_request("an entity needs either id or idPattern")
        return self

    def matches(self, entity: Entity) -> bool:
        """Whether an entity is meant."""
        if self.type not in (None, entity.type):
            return False
        pattern = self.id_pattern
        return (
            pattern.search(entity.id) is not None if pattern else self.id == entity.id
        )


class SubscriptionCondition(Document):
    """Attributes whose change leads to a notification; empty: any attribute."""

    attrs: tuple[str, ...] = ()
    notify_on_metadata_change: Literal[True] = True


class Subject(Document):
    """Entities, and their changes."""

    entities: list[SubscribedEntity] = Field(min_length=1)
    condition: SubscriptionCondition = SubscriptionCondition()


class Endpoint(Document):
    """The receiver of the notifications; Orion's macros in headers are not supported.

    Attributes:
        timeout: Time limit of a response (ms); 5 s where none is given.
    """

    url: str = Field(pattern=r"^http://[^/?#]")
    timeout: PositiveInt | None = None
    headers: dict[str, Annotated[str, Field(pattern=r"^[^$]*$")]] | None = None


class Notification(Document):
    """Content and receiver of the notifications."""

    attrs: tuple[str, ...] = ()
    only_changed_attrs: Literal[False] = False
    attrs_format: Literal["normalized", "keyValues"] = "normalized"
    http: Endpoint | None = None
    http_custom: Endpoint | None = None
    covered: Literal[False] = False

    @model_validator(mode="after")
    def _check(self) -> "Notification":
        if (self.http is None) == (self.http_custom is None):
            raise bad_request("a notification needs either http or httpCustom")
        return self


class SubscriptionDocument(Document):
    """A subscription as its client states it, with Orion's defaults."""

    description: str | None = Field(None, pattern=f"^[^{FORBIDDEN}]*$")
    subject: Subject
    notification: Notification
    status: Literal["active", "inactive"] = "active"
    throttling: NonNegativeInt | None = None


def _read(raw: Mapping[str, Any]) -> SubscriptionDocument:
    try:
        return SubscriptionDocument.model_validate(raw)
    except ValidationError as error:
        complaints = error.errors()
        left_out = [fault for fault in complaints if fault["type"] in _LEFT_OUT]
        first = (left_out or complaints)[0]
        place = "/".join(map(str, first["loc"]))
        if left_out:
            raise not_supported(place) from error
        raise bad_request(f"{place}: {first['msg']}") from error


class Subscription:
    """One subscription, and the results of its notifications.

    Args:
        raw: The document of a ``POST``.
        path: Service path of its entities.
        service: Tenant, as in the notification's header.

    Attributes:
        sent: Number of its notifications; ``sent_at`` the moment of the last (Unix s).
        fails: Notifications without a response since the last response.
        failure: Reason of the last, in libcurl's words; empty for none.

    Raises:
        FiwareError: 400 or 501.
    """

    def __init__(
        self, subscription_id: str, raw: Mapping[str, Any], service: str, path: str
    ) -> None:
        self.id = subscription_id
        self.document = _read(raw)
        self.service, self.path = service, path
        self.sent, self.fails, self.failure = 0, 0, ""
        self.sent_at = float("-inf")
        self._raw = raw
        self._lanes: dict[object, Lane] = {}

    @property
    def receiver(self) -> Endpoint:
        """The receiver of its notifications."""
        notification = self.document.notification
        endpoint = notification.http or notification.http_custom
        assert endpoint is not None  # noqa: S101 - checked by the model
        return endpoint

    def wants(self, entity: Entity, changed: Set[str], now: float) -> bool:
        """Whether a change of these attributes is to be notified.

        A change within the throttling of the last notification is never sent.
        """
        subject, throttling = self.document.subject, self.document.throttling or 0
        return (
            now - self.sent_at >= throttling
            and not changed.isdisjoint(subject.condition.attrs or changed)
            and self.document.status == "active"
            and self.path == entity.path
            and any(subscribed.matches(entity) for subscribed in subject.entities)
        )

    def notify(self, entity: Entity, now: float) -> None:
        """Send an entity to the receiver."""
        notification = self.document.notification
        view = EntityView(notification.attrs, notification.attrs_format == "keyValues")
        self.sent += 1
        self.sent_at = now
        if entity.key not in self._lanes:
            self._lanes[entity.key] = Lane(self)
        self._lanes[entity.key].send(
            b'{"subscriptionId":"%b","data":[%b]}'
            % (self.id.encode(), write_entity(entity, view))
        )

    def change(self, raw: Mapping[str, Any]) -> None:
        """Apply a ``PATCH``; each part in it replaces the old one completely.

        Raises:
            FiwareError: 400 or 501.
        """
        merged = {**self._raw, **raw}
        self.document, self._raw = _read(merged), merged
        self.close()
        if "status" in raw:
            self.fails = 0

    def close(self) -> None:
        """Close the connections; waiting notifications are lost."""
        for lane in self._lanes.values():
            lane.close()
        self._lanes.clear()

    def ended(self, failure: str = "") -> None:
        """Record the end of a notification; any response counts as success."""
        self.fails = self.fails + 1 if failure else 0
        self.failure = failure or self.failure

    def show(self) -> dict[str, Any]:
        """The subscription as a client gets it."""
        fields = self.document.model_dump(mode="json", by_alias=True, exclude_none=True)
        counters = {
            "timesSent": self.sent,
            "failsCounter": self.fails,
            "lastFailureReason": self.failure,
        }
        fields["notification"] |= {key: fact for key, fact in counters.items() if fact}
        return {"id": self.id, **fields}


MOST_WAITING = 300
"""Capacity of one lane: ten seconds of one kind of a robot's measures at 30 Hz."""
IDLE_S = 2.0
"""Longest idle time of a kept connection (s): Node.js closes after 5 s."""

_DEFAULT_TIMEOUT_MS = 5000
_LENGTH = re.compile(rb"\r\ncontent-length: *(\d+)")

REFUSED = "Couldn't connect to server"
TIMED_OUT = "Timeout was reached"
CLOSED = "Server returned nothing (no headers, no data)"


class Lane:
    """A queue and one connection to a receiver, in order.

    Args:
        subscription: Records how each of its notifications ends.
    """

    def __init__(self, subscription: Subscription) -> None:
        self._receiver = subscription.receiver
        self._head = _write_head(subscription)
        self._subscription = subscription
        self._waiting: asyncio.Queue[bytes] = asyncio.Queue(MOST_WAITING)
        self._streams: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None
        self._loop = asyncio.get_running_loop()
        self._used_at = self._loop.time()
        self._task = self._loop.create_task(self._run(), name="embedded-notifications")

    def send(self, body: bytes) -> None:
        """Queue one notification; the oldest of a full queue gives way."""
        if self._waiting.full():
            self._waiting.get_nowait()
            self._subscription.ended(TIMED_OUT)
        self._waiting.put_nowait(body)

    def close(self) -> None:
        """Close the connection; waiting notifications are lost."""
        self._task.cancel()
        self._hang_up()

    async def _run(self) -> None:
        """Send queued notifications until cancelled."""
        limit_s = (self._receiver.timeout or _DEFAULT_TIMEOUT_MS) / 1000
        while True:
            body = await self._waiting.get()
            failure = ""
            try:
                async with asyncio.timeout(limit_s):
                    await self._exchange(body)
            except TimeoutError:
                failure = TIMED_OUT
            except (OSError, EOFError, ValueError, asyncio.LimitOverrunError):
                failure = CLOSED if self._streams else REFUSED
            if failure:
                self._hang_up()
            self._subscription.ended(failure)

    async def _exchange(self, body: bytes) -> None:
        """Send one notification and read the response, whatever its status.

        Raises:
            OSError: the connection failed.
            EOFError: the receiver closed it.
            ValueError: the response is no HTTP.
        """
        reader, writer = await self._connect()
        writer.write(b"%bContent-Length: %d\r\n\r\n%b" % (self._head, len(body), body))
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        if not head.startswith(b"http/1."):
            raise ValueError(head)
        length = _LENGTH.search(head)
        await reader.readexactly(int(length[1]) if length else 0)
        is_kept = length is not None or head.startswith(b"http/1.1 204")
        if not is_kept or b"connection: close" in head or b"http/1.0" in head:
            self._hang_up()
        self._used_at = self._loop.time()

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        """The kept connection where it is of use, else a new one."""
        is_old = self._loop.time() - self._used_at > IDLE_S
        if self._streams is not None and (is_old or self._streams[0].at_eof()):
            self._hang_up()
        if self._streams is None:
            url = urlsplit(self._receiver.url)
            self._streams = await asyncio.open_connection(url.hostname, url.port or 80)
        return self._streams

    def _hang_up(self) -> None:
        if self._streams is not None:
            self._streams[1].transport.abort()
            self._streams = None


def _write_head(subscription: Subscription) -> bytes:
    """The part of a request's head that does not change; no header is empty."""
    receiver = subscription.receiver
    url = urlsplit(receiver.url)
    headers = {
        "host": url.netloc,
        "user-agent": "orion/4.7.0-next libcurl/7.88.1",
        "fiware-service": subscription.service,
        "fiware-servicepath": subscription.path,
        "accept": "application/json",
        "content-type": "application/json; charset=utf-8",
        "ngsiv2-attrsformat": subscription.document.notification.attrs_format,
    }
    for name, value in (receiver.headers or {}).items():
        headers[name.lower()] = value
    target = (url.path or "/") + (f"?{url.query}" if url.query else "")
    lines = [f"{name}: {value}" for name, value in headers.items() if value]
    return "\r\n".join((f"POST {target} HTTP/1.1", *lines, "")).encode()
