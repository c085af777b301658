"""The web face of the DSS: routes, pages and what stands before them."""

from functools import cache
from importlib.resources import files
from typing import Any

from fastapi import Depends, FastAPI
from starlette.staticfiles import StaticFiles

from iveg import __version__
from iveg.adapters import clock, web_push
from iveg.adapters.ids import new_id
from iveg.adapters.outside import is_public_target
from iveg.app import Dss
from iveg.web import notifications, problems
from iveg.web.api import (
    alerts,
    commands,
    costmap,
    coverage,
    day,
    experiments,
    health,
    history,
    latency,
    messages,
    metrics,
    robots,
    rule,
    sign_in_code,
    stop_records,
)
from iveg.web.live import socket
from iveg.web.pages import openapi, routes, service_worker
from iveg.web.security import headers, rate_limits
from iveg.web.security.authentication import (
    require,
)
from iveg.web.security.signin import SignInLink


def create_app(dss: Dss) -> FastAPI:
    """The web face of a DSS; its lifespan runs the rest."""
    app = FastAPI(
        title="iVeg",
        version=__version__,
        description="Supervise mixed robot fleets in greenhouses.",
        lifespan=dss.running,
        docs_url=None,
        redoc_url=None,
        openapi_url=None,
    )
    app.state.authenticator = dss.authenticator
    drawn = routes.Pages(dss.site())
    encoder = socket.Encoder(dss.views, dss.hub, clock.now)
    settings = dss.settings
    tenant = settings.fiware_service, settings.fiware_servicepath
    orion = notifications.NotificationEndpoint(
        dss.ingest,
        dss.notify_secret,
        clock.now,
        dss.is_ours,
        tenant,
        dss.notified,
        dss.is_thinned,
    )
    app.state.orion = orion
    app.router.routes.append(orion.route())
    watch = dss.latency.watch
    app.include_router(
        socket.router(dss.hub, encoder, dss.snapshot, clock.now, dss.stop, watch)
    )
    # Before the routes that would take ``latency`` for the name of a command.
    app.include_router(
        stop_records.router(dss.queries, clock.now, dss.views.find_command)
    )
    app.include_router(robots.router(dss.views, clock.now))
    app.include_router(costmap.router(dss.mapper, dss.evaluator, clock.now))
    app.include_router(coverage.router(dss.coverage, clock.now))
    days = day.Days(dss.queries, dss.evaluator.greenhouse, settings.drill_days)
    app.include_router(day.router(days, drawn, clock.now))
    app.include_router(commands.router(dss.commander, clock.now))
    app.include_router(alerts.router(dss.evaluator, clock.now))
    app.include_router(rule.router(dss.rules, clock.now))
    told_outside = messages.Desk(
        dss.messenger,
        web_push.new_key,
        web_push.public_key,
        web_push.is_public_key,
        is_public_target,
        new_id,
        clock.now,
    )
    app.include_router(messages.router(told_outside))
    app.include_router(sign_in_code.router(dss.sign_in_token))
    app.include_router(
        history.router(
            dss.queries,
            reader=require("read"),
            threshold=lambda: dss.evaluator.rule.threshold,
            present=lambda name: dss.evaluator.decision_record(name, clock.now()),
            flood=dss.views.flood,
            fleet=dss.fleet,
        )
    )
    app.include_router(latency.router(watch, clock.now))
    app.include_router(experiments.router(dss.bench))
    app.include_router(experiments.page_router(drawn))
    app.include_router(service_worker.router())
    app.include_router(health.router(clock.now, dss.views.health))
    app.include_router(metrics.router(clock.now, dss.views.health, watch, dss.queues))
    app.include_router(
        routes.router(
            drawn,
            reader=require("read"),
            anyone=require("open"),
            document=cache(lambda: openapi.describe_api(app)),
            rule=lambda: dss.evaluator.rule,
        )
    )

    @app.get("/openapi.json", dependencies=[Depends(require("read"))])
    async def document() -> Any:
        """This interface in OpenAPI."""
        return app.openapi()

    app.mount("/static", StaticFiles(directory=str(files("iveg") / "static")))
    problems.install(app, drawn.problem)
    app.add_middleware(headers.BodyLimit)
    app.add_middleware(
        rate_limits.SocketLimits, identify=dss.authenticator.identify, clock=clock.now
    )
    app.add_middleware(
        SignInLink, authenticator=dss.authenticator, refusal=drawn.refused_link
    )
    # Last is outermost: a refusal carries the headers, too.
    app.add_middleware(headers.SecurityHeaders)
    app.add_middleware(notifications.NotificationsFirst, endpoint=orion)
    return app
