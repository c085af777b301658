"""Notifications of Orion: authenticate, read, queue, answer (docs/interfaces/ngsi.md).

Hundreds come in a second, so this is plain ASGI beside the layers that pages need, with
its own limit and secret.  Refusals look like those of the rest of the application.
"""

import asyncio
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Protocol

from starlette.responses import Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import EntityReading, Instant, Observation, Received
from iveg.domain.transports import FIWARE
from iveg.ngsi.codec import read_notification
from iveg.vital.ingest import Ingest
from iveg.vital.ports import Clock
from iveg.web.problems import Problem, problem_of
from iveg.web.security.headers import MAX_BODY, NOTIFICATIONS_PATH, TOO_LONG
from iveg.web.security.roles import Action
from iveg.web.security.secrets import same_secret

A_TURN: Final = 8
"""Read in one turn of the loop, which reads one message of each MQTT connection: what
comes straight from a robot must not wait behind copies."""
_TAKEN = Response(status_code=204)
_FORGED = Problem(401, "The notification secret is wrong.")


class Subscriptions(Protocol):
    """Subscriptions that iVeg made at Orion."""

    def is_ours(self, subscription_id: str) -> bool:
        """Whether a subscription is one that iVeg made."""

    def is_former(self, secret: str) -> bool:
        """Whether a secret may be that of our own earlier start."""


@dataclass(frozen=True, slots=True)
class Followers:
    """Listeners to notifications; none of them may wait or fail.

    Attributes:
        notified: Each notification of Orion's came then.
        equipment: Id and type of the entities that ``measured`` is told of.
        measured: A reading of other equipment.
        recorded: Each body that is read, and what is observed in it.
    """

    notified: Callable[[Instant], None]
    equipment: Container[tuple[str, str]]
    measured: Callable[[EntityReading, Instant], None]
    recorded: Callable[[bytes, Instant, Sequence[Observation]], None]


class NotificationEndpoint:
    """Takes Orion's notifications; an ASGI application.

    Args:
        ingest: Where observations go and what cannot be used is counted.
        secret: What a notification must carry.
        clock: Read once a notification.
        subscriptions: Those that iVeg made.
        tenant: The Fiware service and path that count.
        followers: What else is told.
    """

    action: Final[Action] = "open"
    """Its declared action: nobody signs in here; the secret authenticates Orion."""

    def __init__(
        self,
        ingest: Ingest,
        secret: str,
        clock: Clock,
        subscriptions: Subscriptions,
        tenant: tuple[str, str],
        followers: Followers,
    ) -> None:
        self._ingest, self._secret, self._clock = ingest, secret, clock
        self._subscriptions, self._tenant = subscriptions, tenant
        self._followers = followers
        self._turn = asyncio.Semaphore(A_TURN)

    def route(self) -> Route:
        """Its place in the application's table of routes."""
        return Route(
            NOTIFICATIONS_PATH, self, methods=["POST"], include_in_schema=False
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        # Of a header that is there twice the first counts, as everywhere in Starlette.
        headers = dict(reversed(scope["headers"]))
        problem = self._refusal(scope, headers)
        if problem is None and not self._is_foreign(headers):
            body = await _body(receive)
            if body is None:
                return
            if len(body) > MAX_BODY:
                problem = Problem(413, TOO_LONG)
            else:
                async with self._turn:
                    await asyncio.sleep(0)
                    problem = self.receive(body)
        answer = _TAKEN if problem is None else problem.response()
        await answer(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Mapping[bytes, bytes]) -> Problem | None:
        """The reason not to read the body at all; None to read it."""
        declared = headers.get(b"content-length", b"")
        if declared.isdigit() and int(declared) > MAX_BODY:
            # The unread body would be taken for the next request.
            return Problem(413, TOO_LONG, headers={"Connection": "close"})
        given = headers.get(b"x-iveg-notify-token", b"").decode("latin-1")
        if same_secret(given, self._secret):
            return None
        if given and self._subscriptions.is_former(given):
            # Our own subscriptions until they are mended: no reason to suspect anybody.
            self._ingest.counters["rejected.former_secret"] += 1
            return _FORGED
        client = scope.get("client")
        self._ingest.reject(client[0] if client else "?", "forged_notification")
        return _FORGED

    def _is_foreign(self, headers: Mapping[bytes, bytes]) -> bool:
        """Whether it is of another tenant: taken, counted and ignored."""
        if _tenant_of(headers) == self._tenant:
            return False
        self._ingest.reject(_tenant_of(headers)[0] or "?", "foreign_tenant")
        return True

    def receive(self, body: bytes) -> Problem | None:
        """Take a body that has just come; what is wrong with it, or None."""
        at, followers = self._clock(), self._followers
        try:
            subscription_id, reading = read_notification(
                body,
                partial(self._ingest.is_past, now=at.mono),
                followers.equipment,
            )
        except UnreadableError as error:
            return problem_of(error)
        if not self._subscriptions.is_ours(subscription_id):
            self._ingest.reject(subscription_id, "unknown_subscription")
            return None
        followers.notified(at)
        followers.recorded(body, at, reading.observations)
        for problem in reading.problems:
            self._ingest.reject(problem.source, problem.reason, problem.detail)
        for entity in reading.equipment:
            followers.measured(entity, at)
        for observation in reading.observations:
            self._ingest.enqueue_copy(Received(observation, at, FIWARE.id))
        return None


class NotificationsFirst:
    """The outermost layer: hands notifications to their endpoint, and all else on.

    Another method than POST goes on too, to be refused like everywhere.
    """

    def __init__(self, app: ASGIApp, endpoint: NotificationEndpoint) -> None:
        self._app = app
        self._endpoint = endpoint

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        if (
            scope["type"] == "http"
            and scope["path"] == NOTIFICATIONS_PATH
            and scope["method"] == "POST"
        ):
            await self._endpoint(scope, receive, send)
        else:
            await self._app(scope, receive, send)


def _tenant_of(headers: Mapping[bytes, bytes]) -> tuple[str, str]:
    service = headers.get(b"fiware-service", b"").decode("latin-1")
    return service, headers.get(b"fiware-servicepath", b"").decode("latin-1")


async def _body(receive: Receive) -> bytes | None:
    """The whole body; of one that is too long no more than shows it; None: cut off."""
    body = b""
    while len(body) <= MAX_BODY:
        message = await receive()
        if message["type"] == "http.disconnect":
            return None
        body += message["body"]
        if not message["more_body"]:
            break
    return body
