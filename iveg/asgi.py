"""Web side of the server: routes and middleware, made from the composed parts."""

import asyncio
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from fastapi import APIRouter, FastAPI
from starlette.routing import Mount

from iveg import __version__
from iveg.adapters.recordings.recorder import InputRecorder
from iveg.adapters.worker import Worker
from iveg.app import App
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
    account,
    alerts,
    commands,
    day,
    detections,
    goals,
    health,
    history,
    incidents,
    latency,
    past,
    robots,
    rule,
)
from iveg.web.api.answers import Json
from iveg.web.live import socket
from iveg.web.live.encoder import Encoder
from iveg.web.live.pictures import Past
from iveg.web.pages import drawing, routes
from iveg.web.pages.contexts import Site
from iveg.web.security import audited, headers, rate_limits
from iveg.web.security.authentication import Authenticator
from iveg.web.security.requirements import READERS, DocumentedApp
from iveg.web.security.roles import Principal
from iveg.web.static_files import KeptFiles
from iveg.web.views import Views

_STATIC = Path(__file__).with_name("static")


@dataclass(frozen=True, slots=True, kw_only=True)
class WebParts:
    """The parts that answer requests for the present state.

    Attributes:
        orion: Takes Orion's notifications.
        queues: Reads the depth of the queues.
        worker: Does long work in another process.
        encoder: Encodes topics for pages.
        recordings: Recorded messages, as files.
        past: Recorded pictures, by their moment.
        trail: Records deeds of people and programs.
        accounts: Reads the state of the file of accounts.
    """

    pipeline: Pipeline
    views: Views
    authenticator: Authenticator
    orion: notifications.NotificationEndpoint
    site: Site
    queues: Callable[[], health.Queues]
    clock: Clock
    worker: Worker
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
            user=User.from_value(principal),
            **topics.read_all(self.views, now),
        )

    async def stop(self, robot_id: str | None, who: Principal, press: Press) -> None:
        """STOP one robot, or all, as a WebSocket asked."""
        commander = self.pipeline.commander
        targets = commander.machines if robot_id is None else [robot_id]
        await commander.stop(targets, who.name, self.clock(), press)
        # The middleware of the audit sees HTTP alone.
        details = {"press_id": press.press_id, "socket": True}
        self.trail.note(who, "stop", robot_id or "", details, at=self.clock())


def web_parts(app: App) -> WebParts:
    """The parts of a composed iVeg that answer requests."""
    return WebParts(
        pipeline=app.pipeline,
        views=app.views,
        authenticator=app.authenticator,
        orion=app.orion,
        site=app.site,
        queues=partial(_queues, app),
        clock=app.core.ports.clock,
        worker=app.worker,
        recordings=app.connections.inputs,
        trail=app.trail,
        past=app.past,
        encoder=app.encoder,
        accounts=lambda: app.accounts.state,
    )


def create_app(app: App) -> FastAPI:
    """Build the web side of an iVeg; its lifespan runs the other parts."""
    web = web_parts(app)
    pages = drawing.Pages(web.site)
    site = build_app(
        web,
        pages,
        [*live_routers(web), *_past_routers(app, pages)],
        title="iVeg",
        version=__version__,
        description="Supervise mixed robot fleets in greenhouses.",
        lifespan=app.running,
    )
    page_router = routes.router(
        pages, rule=lambda: app.pipeline.evaluator.rule, sign_on=app.sign_on
    )
    site.router.routes.extend(page_router.routes)

    @site.get("/openapi.json", dependencies=READERS)
    async def document() -> object:
        """This interface in OpenAPI."""
        # In a thread: the first call takes most of a second, FastAPI keeps the result.
        return Json(await asyncio.to_thread(site.openapi))

    # First: a page has 200 files, and each would be compared with every other route.
    site.router.routes.insert(0, Mount("/static", KeptFiles(_STATIC)))
    return site


def build_app(
    web: WebParts, pages: drawing.Pages, routers: Iterable[APIRouter], **facts: Any
) -> FastAPI:
    """The application with these routes and its middleware.

    Args:
        web: Parts that answer.
        pages: Draws problems for people.
        routers: Routes.
        facts: Further arguments of FastAPI.
    """
    app = DocumentedApp(docs_url=None, redoc_url=None, openapi_url=None, **facts)
    app.state.authenticator, app.state.orion = web.authenticator, web.orion
    app.router.routes.append(web.orion.route())
    for router in routers:
        # ``include_router`` would make each route anew at the first request.
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


def live_routers(web: WebParts) -> Iterator[APIRouter]:
    """Routers of the present: all but history and pages."""
    parts, views, clock = web.pipeline, web.views, web.clock
    watch, evaluator = parts.latency, parts.evaluator
    yield socket.router(parts.hub, web.encoder, web.snapshot, clock, web.stop, watch)
    yield robots.router(views, clock)
    yield robots.cells_router(parts.mapper, evaluator, parts.coverage, clock)
    yield commands.router(parts.commander, clock)
    yield goals.router(parts.goals, clock)
    yield alerts.router(evaluator, clock)
    yield rule.router(parts.rules, parts.trials, clock)
    yield detections.router(evaluator.tracking.newest)
    yield detections.words_router(parts.detectors, parts.things, clock)
    yield latency.router(watch, clock, web.worker)
    yield past.router(web.recordings, web.past, clock)
    yield health.router(clock, views.health, web.accounts, watch, web.queues)


def _past_routers(app: App, pages: drawing.Pages) -> Iterator[APIRouter]:
    """Routers of the history and of accounts."""
    queries, worker, clock = app.connections.queries, app.worker, app.core.ports.clock
    views, evaluator, log = app.views, app.pipeline.evaluator, app.core.event_log.log
    yield day.stop_records_router(queries, clock, views.find_command)
    url, greenhouse = queries.url, evaluator.greenhouse
    yield day.router(
        lambda *args: worker.run(day.read_day, url, greenhouse, *args), pages, clock
    )
    yield history.router(
        queries,
        worker,
        present=evaluator.decision_record,
        alerts=views.alerts,
        fleet=app.fleet,
    )
    yield incidents.router(
        incidents.Sources(
            queries,
            app.connections.inputs,
            app.packer,
            lambda: app.pipeline.rules.versions,
            app.settings.without_secrets(),
            log,
            clock,
            __version__,
        )
    )
    yield alerts.notes_router(queries, log, clock)
    yield account.router(app.accounts.people)
    yield account.sessions_router()
    yield account.users_router(app.accounts.people)
    yield account.tokens_router(app.accounts.people)
    yield routes.service_worker_router()


def _queues(app: App) -> health.Queues:
    """Depth of each queue, and messages dropped from it."""
    ingest, history_counts = app.pipeline.ingest, app.connections.recorder.counters
    link = app.connections.link
    dropped = sum(
        n for name, n in ingest.counters.items() if name.startswith("dropped.")
    )
    return health.Queues(
        depths={
            "ingest": ingest.waiting,
            "history": history_counts["history_waiting"],
            "mqtt_out": link.offered,
        },
        dropped={
            "ingest": dropped,
            "history": history_counts["history_dropped"],
            "mqtt_out": link.replaced,
        },
    )
