"""Composition of the web face from its parts, for iVeg and for its tests."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from fastapi import APIRouter, FastAPI

from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.domain.stop import Press
from iveg.models.snapshot import Server, Snapshot, User
from iveg.pipeline import Pipeline, Services
from iveg.vital import topics
from iveg.vital.audit import AuditTrail
from iveg.vital.ports import Clock, Ids
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
from iveg.web.refusals import DocumentedApp
from iveg.web.security import audited, headers, rate_limits
from iveg.web.security.authentication import Authenticator
from iveg.web.security.rate_limits import SignInGate
from iveg.web.security.roles import Principal
from iveg.web.security.signin import SignInLink
from iveg.web.views import Views


@dataclass(frozen=True, slots=True, kw_only=True)
class Face:
    """The parts that answer requests for the present state.

    Attributes:
        orion: Takes Orion's notifications.
        boot: Random, new at each start.
        queues: How full the queues are.
        worker: Where long work is done.
        encoder: Encodes for pages.
        recordings: What came in, as files.
        past: What pages were told, by its moment.
        trail: Takes what people and programs do.
        accounts: State of their file.
    """

    pipeline: Pipeline
    services: Services
    views: Views
    authenticator: Authenticator
    orion: notifications.NotificationEndpoint
    site: Site
    boot: str
    queues: Callable[[], health.Queues]
    clock: Clock
    new_id: Ids
    worker: Apart
    recordings: past.Recordings
    trail: AuditTrail
    past: Past
    encoder: Encoder
    accounts: Callable[[], str] = lambda: "ok"

    def snapshot(self, principal: Principal, now: Instant) -> Snapshot:
        """Everything that is known, for a browser that has just come."""
        server = Server(
            boot=self.boot,
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


def live_routers(face: Face) -> Iterator[Callable[[], APIRouter]]:
    """What makes the routes of now: all but history and pages."""
    parts, beside, views, clock = face.pipeline, face.services, face.views, face.clock
    watch, evaluator = parts.latency, parts.evaluator
    yield partial(
        socket.router, parts.hub, face.encoder, face.snapshot, clock, face.stop, watch
    )
    yield partial(robots.router, views, clock)
    yield partial(robots.equipment_router, views, clock)
    yield partial(robots.costmap_router, beside.mapper, evaluator, clock)
    yield partial(robots.coverage_router, beside.coverage, clock)
    yield partial(commands.router, parts.commander, clock)
    yield partial(goals.router, parts.goals, clock)
    yield partial(alerts.router, evaluator, clock)
    yield partial(rule.router, beside.rules, clock)
    yield partial(rule.trial_router, beside.trials, beside.rules, clock)
    yield partial(detections.router, evaluator.tracking.newest, face.worker)
    yield partial(detections.detectors_router, beside.detectors, clock)
    yield partial(detections.words_router, beside.detectors, clock)
    yield partial(detections.things_router, beside.things, clock)
    yield partial(latency.router, watch, clock, face.worker)
    yield partial(past.recordings_router, face.recordings)
    yield partial(past.router, face.past, clock)
    yield partial(health.router, clock, views.health, face.accounts)
    turns = parts.supervision.longest_turn_s
    yield partial(health.metrics_router, clock, views.health, watch, face.queues, turns)


def build_app(
    face: Face,
    pages: Pages,
    routers: Iterable[APIRouter],
    **facts: Any,
) -> FastAPI:
    """The application with these routes, and what stands before them.

    Args:
        face: Its parts.
        pages: Draws problems for people.
        routers: Its routes.
        facts: Further arguments of FastAPI.
    """
    app = DocumentedApp(docs_url=None, redoc_url=None, openapi_url=None, **facts)
    app.state.authenticator, app.state.orion = face.authenticator, face.orion
    app.router.routes.append(face.orion.route())
    for router in routers:
        # As they are: what is included is made anew at the first request.
        app.router.routes.extend(router.routes)
    problems.install(app, pages.problem)
    identify, clock = face.authenticator.identify, face.clock
    app.add_middleware(headers.ReadableBodies)
    app.add_middleware(
        audited.AuditRequests, identify=identify, trail=face.trail, clock=clock
    )
    app.add_middleware(headers.BodyLimit)
    app.add_middleware(rate_limits.SocketLimits, identify=identify, clock=clock)
    app.add_middleware(
        SignInLink, authenticator=face.authenticator, refusal=pages.refused_link
    )
    app.add_middleware(SignInGate, clock=clock)
    # Last is outermost: a refusal carries the headers, too.
    app.add_middleware(headers.SecurityHeaders)
    return app
