"""Notifications of Orion: authenticate, read, queue, answer (docs/interfaces/ngsi.md).

Hundreds come in a second, so this is plain ASGI beside the layers that pages need, with
its own limit and secret.  Refusals look like those of the rest of the application.
"""

from collections.abc import Callable, Container, Mapping, Sequence
from typing import Final

from starlette.routing import Route
from starlette.types import ASGIApp, Receive, Scope, Send

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import EntityReading, Instant, Observation, Received
from iveg.domain.transports import FIWARE
from iveg.ngsi.codec import UNREAD, read_notification
from iveg.pipeline.ingest import Ingest
from iveg.pipeline.ports import Clock
from iveg.web.problem import Problem
from iveg.web.problems import problem_of
from iveg.web.security.headers import MAX_BODY, NOTIFICATIONS_PATH, TOO_LONG
from iveg.web.security.roles import Action
from iveg.web.security.secrets import NotifySecret

Recorded = Callable[[bytes, Instant, Sequence[Observation]], None]
_TAKEN = (
    {"type": "http.response.start", "status": 204, "headers": []},
    {"type": "http.response.body", "body": b""},
)
_FORGED = Problem(401, "The notification secret is wrong.")


class NotificationEndpoint:
    """Takes Orion's notifications; an ASGI application.

    Args:
        ingest: Where observations go and what cannot be used is counted.
        secret: What a notification must carry.
        clock: Read once a notification.
        is_ours: Whether a subscription id is one that iVeg made.
        tenant: The Fiware service and path that count.
        heard: Told of each notification of Orion's.
        is_thinned: Whether Orion leaves out most of what a subscription is about.
        equipment: Id and type of the entities that ``measured`` is told of.
        measured: Told of other equipment; must neither wait nor fail.
        recorded: Told of each body that is read and what is observed in it; likewise.
        is_former: Whether a secret may be that of our own earlier start.
    """

    action: Final[Action] = "open"
    """Its declared action: nobody signs in here; the secret authenticates Orion."""

    def __init__(
        self,
        ingest: Ingest,
        secret: NotifySecret,
        clock: Clock,
        is_ours: Callable[[str], bool],
        tenant: tuple[str, str],
        heard: Callable[[Instant], None],
        is_thinned: Callable[[str], bool],
        equipment: Container[tuple[str, str]] = frozenset(),
        measured: Callable[[EntityReading, Instant], None] = lambda *_: None,
        recorded: Recorded = lambda *_: None,
        is_former: Callable[[str], bool] = lambda _: False,
    ) -> None:
        self._ingest = ingest
        self._secret = secret
        self._clock = clock
        self._is_ours = is_ours
        self._tenant = tenant
        self._heard = heard
        self._is_thinned = is_thinned
        self._equipment = equipment
        self._measured = measured
        self._recorded = recorded
        self._is_former = is_former

    def route(self) -> Route:
        """Its place in the application's table of routes."""
        return Route(
            NOTIFICATIONS_PATH, self, methods=["POST"], include_in_schema=False
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve one request."""
        at = self._clock()
        # Of a header that is there twice the first counts, as everywhere in Starlette.
        headers = dict(reversed(scope["headers"]))
        problem = self._refusal(scope, headers)
        if problem is None and not self._is_foreign(headers):
            try:
                body = await _body(receive)
            except _GoneError:
                return
            problem = (
                Problem(413, TOO_LONG) if body is None else self._receive(body, at)
            )
        if problem is None:
            for message in _TAKEN:
                await send(message)
        else:
            await problem.response()(scope, receive, send)

    def fits_at_once(self, headers: Mapping[bytes, bytes]) -> bool:
        """Whether nothing but the body can be wrong; names are in lower case.

        A body of undeclared length takes the slow path, which counts bytes.
        """
        length = headers.get(b"content-length", b"")
        return (
            length.isdigit()
            and int(length) <= MAX_BODY
            and b"transfer-encoding" not in headers
            and _tenant_of(headers) == self._tenant
            and self._is_admitted(headers)
        )

    def receive(self, body: bytes) -> Problem | None:
        """Take a body that has just come; what is wrong with it, or None."""
        return self._receive(body, self._clock())

    def _refusal(self, scope: Scope, headers: Mapping[bytes, bytes]) -> Problem | None:
        """The reason not to read the body at all; None to read it."""
        declared = headers.get(b"content-length", b"")
        if declared.isdigit() and int(declared) > MAX_BODY:
            # The unread body would be taken for the next request.
            return Problem(413, TOO_LONG, headers={"Connection": "close"})
        if self._is_admitted(headers):
            return None
        given = _secret_of(headers)
        if given and self._is_former(given):
            # Our own subscriptions until they are mended: no reason to suspect anybody.
            self._ingest.counters["rejected.former_secret"] += 1
            return _FORGED
        client = scope.get("client")
        self._ingest.reject(client[0] if client else "?", "forged_notification")
        return _FORGED

    def _is_admitted(self, headers: Mapping[bytes, bytes]) -> bool:
        return self._secret.admits(_secret_of(headers))

    def _is_foreign(self, headers: Mapping[bytes, bytes]) -> bool:
        """Whether it is of another tenant: taken, counted and ignored."""
        if _tenant_of(headers) == self._tenant:
            return False
        self._ingest.reject(_tenant_of(headers)[0] or "?", "foreign_tenant")
        return True

    def _receive(self, body: bytes, at: Instant) -> Problem | None:
        try:
            subscription_id, reading = read_notification(
                body, self._ingest.is_past, UNREAD, self._equipment
            )
        except UnreadableError as error:
            return problem_of(error)
        if not self._is_ours(subscription_id):
            self._ingest.reject(subscription_id, "unknown_subscription")
            return None
        self._heard(at)
        self._recorded(body, at, reading.observations)
        for problem in reading.problems:
            self._ingest.reject(problem.source, problem.reason, problem.detail)
        for entity in reading.equipment:
            self._measured(entity, at)
        thinned = self._is_thinned(subscription_id)
        for observation in reading.observations:
            self._ingest.enqueue(Received(observation, at, FIWARE.id, thinned=thinned))
        return None


class NotificationsFirst:
    """Middleware: hands notifications to their endpoint, and all else on.

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


def _secret_of(headers: Mapping[bytes, bytes]) -> str:
    """The secret that a notification brings; empty for none."""
    return headers.get(b"x-iveg-notify-token", b"").decode("latin-1")


def _tenant_of(headers: Mapping[bytes, bytes]) -> tuple[str, str]:
    service = headers.get(b"fiware-service", b"").decode("latin-1")
    return service, headers.get(b"fiware-servicepath", b"").decode("latin-1")


class _GoneError(Exception):
    """The sender hung up before its body was here."""


async def _body(receive: Receive) -> bytes | None:
    """The whole body; None where it is longer than a body may be."""
    parts: list[bytes] = []
    size = 0
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            raise _GoneError
        part = message.get("body", b"")
        size += len(part)
        if size > MAX_BODY:
            return None
        parts.append(part)
        if not message.get("more_body", False):
            return b"".join(parts) if len(parts) > 1 else part
