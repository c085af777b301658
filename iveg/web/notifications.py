"""Notifications of Orion: authenticate, read, queue, answer (docs/interfaces/ngsi.md).

Hundreds come in a second, so this is plain ASGI beside the layers that pages need, with
its own limit and secret.  Refusals look like those of the rest of the application.
"""

import asyncio
from collections.abc import Container, Mapping
from typing import Final

from starlette.responses import Response
from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.adapters.reconciler import OwnSubscriptions
from iveg.domain.errors import UnreadableError
from iveg.domain.observations import Received
from iveg.domain.transports import FIWARE
from iveg.ngsi.codec import read_notification
from iveg.vital.core import Core
from iveg.vital.ingest import Ingest
from iveg.web.problems import Problem, problem_of
from iveg.web.security.headers import MAX_BODY, NOTIFICATIONS_PATH, TOO_LONG
from iveg.web.security.roles import Action
from iveg.web.security.secrets import same_secret

A_TURN: Final = 8
"""Notifications in one turn of the loop, which reads one message of each MQTT
connection: a robot's own message must not wait behind many copies."""
_TAKEN = Response(status_code=204)
_FORGED = Problem(401, "The notification secret is wrong.")


class NotificationEndpoint:
    """Takes Orion's notifications; an ASGI application.

    Args:
        core: Clock, health and listeners.
        ingest: Takes observations, and counts what cannot be used.
        secret: Secret that a notification must carry.
        subscriptions: Subscriptions that iVeg made.
        tenant: FIWARE service and path that are accepted.
        equipment: Id and type of each entity of other equipment.
    """

    action: Final[Action] = "open"
    """Its declared action: nobody signs in here; the secret authenticates Orion."""

    def __init__(
        self,
        core: Core,
        ingest: Ingest,
        secret: str,
        subscriptions: OwnSubscriptions,
        tenant: tuple[str, str],
        equipment: Container[tuple[str, str]],
    ) -> None:
        self._clock, self._health_monitor = core.ports.clock, core.health_monitor
        self._tell = core.supervision.tell
        self._ingest, self._secret, self._equipment = ingest, secret, equipment
        self._subscriptions, self._tenant = subscriptions, tenant
        self._turn = asyncio.Semaphore(A_TURN)

    def route(self) -> Route:
        """Its place in the application's table of routes."""
        return Route(
            NOTIFICATIONS_PATH, self, methods=["POST"], include_in_schema=False
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        # Of a repeated header the first counts, as everywhere in Starlette.
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
                    # At most ``A_TURN`` of them pass this point in a turn of the loop.
                    await asyncio.sleep(0)
                    problem = self.receive(body)
        answer = _TAKEN if problem is None else problem.response()
        await answer(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Mapping[bytes, bytes]) -> Problem | None:
        """The problem for which the body is not read; None to read it."""
        declared = headers.get(b"content-length", b"")
        if declared.isdigit() and int(declared) > MAX_BODY:
            # The unread body would be taken for the next request.
            return Problem(413, TOO_LONG, headers={"Connection": "close"})
        given = headers.get(b"x-iveg-notify-token", b"").decode("latin-1")
        if same_secret(given, self._secret):
            return None
        if given and self._subscriptions.is_former(given):
            # An earlier start of ours made that subscription; the provisioner mends it.
            self._ingest.counters["rejected.former_secret"] += 1
            return _FORGED
        client = scope.get("client")
        self._ingest.reject(client[0] if client else "?", "forged_notification")
        return _FORGED

    def _is_foreign(self, headers: Mapping[bytes, bytes]) -> bool:
        """Whether another tenant sent it; it is answered, counted and ignored."""
        if _tenant_of(headers) == self._tenant:
            return False
        self._ingest.reject(_tenant_of(headers)[0] or "?", "foreign_tenant")
        return True

    def receive(self, body: bytes) -> Problem | None:
        """Take a body that has just come; returns the problem with it, or None."""
        at = self._clock()
        try:
            subscription_id, reading = read_notification(
                body, self._equipment, self._ingest.is_known
            )
        except UnreadableError as error:
            return problem_of(error)
        if not self._subscriptions.is_ours(subscription_id):
            self._ingest.reject(subscription_id, "unknown_subscription")
            return None
        self._health_monitor.notified_at = at.mono
        self._tell("notified", body, at)
        for problem in reading.problems:
            self._ingest.reject(problem.source, problem.reason, problem.detail)
        for entity in reading.equipment:
            self._tell("entity_read", entity, at)
        for observation in reading.observations:
            self._ingest.enqueue_copy(Received(observation, at, FIWARE.id))
        return None


def notifications_first(app: ASGIApp, endpoint: NotificationEndpoint) -> ASGIApp:
    """The application, whose outer layers notifications pass by.

    Those layers would take a twentieth of the loop's time.
    """
    first = "http", "POST", NOTIFICATIONS_PATH

    async def serve(scope: Scope, receive: Receive, send: Send) -> None:
        request = scope["type"], scope.get("method"), scope.get("path")
        await (endpoint if request == first else app)(scope, receive, send)

    return serve


def _tenant_of(headers: Mapping[bytes, bytes]) -> tuple[str, str]:
    service = headers.get(b"fiware-service", b"").decode("latin-1")
    return service, headers.get(b"fiware-servicepath", b"").decode("latin-1")


async def _body(receive: Receive) -> bytes | None:
    """The body, read up to just beyond its limit; None where the sender went away."""
    body = b""
    while len(body) <= MAX_BODY:
        message = await receive()
        if message["type"] == "http.disconnect":
            return None
        body += message["body"]
        if not message["more_body"]:
            break
    return body
