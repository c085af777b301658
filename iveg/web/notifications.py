"""Orion → iVeg: authenticate, read, queue, answer at once (interfaces.md §2)."""

from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Request
from starlette.responses import Response

from iveg.domain.observations import Instant, Received
from iveg.ngsi.codec import read_notification
from iveg.pipeline.ingest import Ingest
from iveg.web.auth import NotifySecret, require
from iveg.web.problems import Problem

_TAKEN = Response(status_code=204)


def router(
    ingest: Ingest,
    secret: NotifySecret,
    clock: Callable[[], Instant],
    is_ours: Callable[[str], bool],
    tenant: tuple[str, str],
    heard: Callable[[Instant], None],
) -> APIRouter:
    """The notification endpoint.

    ``is_ours`` says whether a subscription id is one that iVeg made, ``tenant`` which
    Fiware service and path count; ``heard`` is told of each notification of Orion's.
    """
    routes = APIRouter()

    @routes.post(
        "/ngsi/notifications",
        status_code=204,
        dependencies=[Depends(require("open"))],
        include_in_schema=False,
    )
    async def notify(
        request: Request,
        x_iveg_notify_token: Annotated[str | None, Header()] = None,
        fiware_service: Annotated[str | None, Header()] = None,
        fiware_servicepath: Annotated[str | None, Header()] = None,
    ) -> Response:
        """Take one notification; 204 also for what is not ours (counted)."""
        at = clock()
        if not secret.admits(x_iveg_notify_token):
            source = request.client.host if request.client else "?"
            ingest.reject(source, "forged_notification")
            return Problem(401, "The notification secret is wrong.").response()
        if (fiware_service or "", fiware_servicepath or "") != tenant:
            ingest.reject(fiware_service or "?", "foreign_tenant")
            return _TAKEN
        subscription_id, reading = read_notification(await request.body())
        if not is_ours(subscription_id):
            ingest.reject(subscription_id, "unknown_subscription")
            return _TAKEN
        heard(at)
        for problem in reading.problems:
            ingest.reject(problem.source, problem.reason, problem.detail)
        for observation in reading.observations:
            ingest.offer(Received(observation, at, "orion"))
        return _TAKEN

    return routes
