"""Routes of the present and what stands before them, made of the composed parts."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from fastapi import APIRouter, FastAPI

from iveg.adapters.recordings.recorder import InputRecorder
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.domain.stop import Press
from iveg.models.snapshot import Server, Snapshot, User
from iveg.pipeline import Pipeline
from iveg.vital import topics
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock
from iveg.web import notifications, problems
from iveg.web.api import (
    alerts,
    commands,
    detections,
    goals,
    health,
    latency,
    past,
    robots,
    rule,
)
from iveg.web.api.answers import Apart
from iveg.web.live import socket
from iveg.web.live.encoder import Encoder
from iveg.web.live.pictures import Past
from iveg.web.pages.contexts import Site
from iveg.web.pages.drawing import Pages
from iveg.web.security import audited, headers, rate_limits
from iveg.web.security.authentication import Authenticator
from iveg.web.security.requirements import DocumentedApp
from iveg.web.security.roles import Principal
from iveg.web.views import Views


@dataclass(frozen=True, slots=True, kw_only=True)
class WebParts:
    """The parts that answer requests for the present state.

    Attributes:
        orion: Takes Orion's notifications.
        queues: How full the queues are.
        worker: Where long work is done.
        encoder: Encodes for pages.
        recordings: What came in, as files.
        past: What pages were told, by its moment.
        trail: Takes what people and programs do.
        accounts: State of their file.
    """

    pipeline: Pipeline
    views: Views
    authenticator: Authenticator
    orion: notifications.NotificationEndpoint
    site: Site
    queues: Callable[[], health.Queues]
    clock: Clock
    worker: Apart
    recordings: InputRecorder
    trail: AuditTrail
    past: Past
    encoder: Encoder
    accounts: Callable[[], str]

    def snapshot(self, principal: Principal, now: Instant) -> Snapshot:
        """Everything that is known, for a browser that has just come."""
        server = Server(
            boot=self.pipeline.core.boot,
            version=self.site.version,
            demo=self.site.demo,
            wall=now.wall,
        )
        return Snapshot(
            t=format_stamp(now.wall),
            server=server,
            user=User(name=principal.name, role=principal.role),
            **topics.read_all(self.views, now),
        )

    async def stop(self, robot_id: str | None, who: Principal, press: Press) -> None:
        """STOP one robot, or all; asked on a WebSocket."""
        commander = self.pipeline.commander
        targets = commander.machines if robot_id is None else [robot_id]
        await commander.stop(targets, who.name, self.clock(), press)
        details = {"press_id": press.press_id, "socket": True}
        self.trail.note(who, "stop", robot_id or "", details, at=self.clock())


def live_routers(web: WebParts) -> Iterator[Callable[[], APIRouter]]:
    """Makers of the routes of the present: all but history and pages."""
    parts, views, clock = web.pipeline, web.views, web.clock
    watch, evaluator = parts.latency, parts.evaluator
    yield partial(
        socket.router, parts.hub, web.encoder, web.snapshot, clock, web.stop, watch
    )
    yield partial(robots.router, views, clock)
    cells = parts.mapper, evaluator, parts.coverage, clock
    yield partial(robots.cells_router, *cells)
    yield partial(commands.router, parts.commander, clock)
    yield partial(goals.router, parts.goals, clock)
    yield partial(alerts.router, evaluator, clock)
    yield partial(rule.router, parts.rules, parts.trials, clock)
    yield partial(detections.router, evaluator.tracking.newest)
    yield partial(detections.words_router, parts.detectors, parts.things, clock)
    yield partial(latency.router, watch, clock, web.worker)
    yield partial(past.router, web.recordings, web.past, clock)
    beside = web.accounts, watch, web.queues
    yield partial(health.router, clock, views.health, *beside)


def build_app(
    web: WebParts,
    pages: Pages,
    routers: Iterable[APIRouter],
    **facts: Any,
) -> FastAPI:
    """The application with these routes, and what stands before them.

    Args:
        web: Its parts.
        pages: Draws problems for people.
        routers: Its routes.
        facts: Further arguments of FastAPI.
    """
    app = DocumentedApp(docs_url=None, redoc_url=None, openapi_url=None, **facts)
    app.state.authenticator, app.state.orion = web.authenticator, web.orion
    app.router.routes.append(web.orion.route())
    for router in routers:
        # As they are: what is included is made anew at the first request.
        app.router.routes.extend(router.routes)
    problems.install(app, pages.problem)
    identify, clock = web.authenticator.identify, web.clock
    app.add_middleware(
        audited.AuditRequests, identify=identify, trail=web.trail, clock=clock
    )
    app.add_middleware(rate_limits.SocketLimits, identify=identify, clock=clock)
    app.add_middleware(rate_limits.SignInGate, clock=clock)
    # Last is outermost: a refusal carries the headers, too.
    app.add_middleware(headers.Bounds)
    return app
