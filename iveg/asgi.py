"""The web side of the server: routes of the present, of the past, and the pages."""

import asyncio
from collections.abc import Iterator
from pathlib import Path

from fastapi import APIRouter, Depends, FastAPI
from starlette.routing import Mount

from iveg import __version__
from iveg.app.dss import Dss
from iveg.web.api import account, alerts, day, history, incidents
from iveg.web.api.answers import Json
from iveg.web.build import build_app, live_routers
from iveg.web.pages import drawing, routes
from iveg.web.security.requirements import require
from iveg.web.static_files import KeptFiles

_STATIC = Path(__file__).with_name("static")


def create_app(dss: Dss) -> FastAPI:
    """The web side of a DSS; its lifespan runs the rest."""
    # Whoever has the link needs no admin.
    pages = drawing.Pages(
        dss.web.site, lambda: dss.web.site.link or dss.accounts.people.is_led()
    )
    app = build_app(
        dss.web,
        pages,
        [*(make() for make in live_routers(dss.web)), *_past_routers(dss, pages)],
        title="iVeg",
        version=__version__,
        description="Supervise mixed robot fleets in greenhouses.",
        lifespan=dss.running,
    )
    of_pages = routes.router(
        pages,
        rule=lambda: dss.pipeline.evaluator.rule,
        sign_on=dss.sign_on,
    )
    app.router.routes.extend(of_pages.routes)

    @app.get("/openapi.json", dependencies=[Depends(require("read"))])
    async def document() -> object:
        """This interface in OpenAPI."""
        # Made once, in a thread: it takes most of a second.
        return Json(await asyncio.to_thread(app.openapi))

    # First of all routes: a page has 200 files, and each would be compared with each.
    app.router.routes.insert(0, Mount("/static", KeptFiles(_STATIC)))
    return app


def _past_routers(dss: Dss, pages: drawing.Pages) -> Iterator[APIRouter]:
    """History, and what a browser needs besides."""
    queries, web = dss.stores.queries, dss.web
    views, evaluator, clock = web.views, dss.pipeline.evaluator, web.clock
    yield day.stop_records_router(queries, clock, views.find_command)
    url, greenhouse, worker = queries.url, evaluator.greenhouse, dss.worker
    yield day.router(
        lambda *asked: worker.run(day.read_day, url, greenhouse, *asked), pages, clock
    )
    yield history.router(
        queries,
        worker,
        threshold=lambda: evaluator.rule.threshold.every,
        present=evaluator.decision_record,
        alerts=views.alerts,
        fleet=dss.fleet,
    )
    yield incidents.router(
        incidents.Sources(
            queries,
            dss.stores.inputs,
            dss.packer,
            lambda: dss.pipeline.rules.versions,
            dss.settings.without_secrets(),
            dss.core.event_log.log,
            clock,
            __version__,
        )
    )
    yield alerts.notes_router(queries, dss.fleet.members, dss.core.event_log.log, clock)
    if dss.sign_in_token:
        yield account.sign_in_code_router(dss.sign_in_token)
    yield account.router(dss.accounts.people)
    yield account.sessions_router()
    yield account.users_router(dss.accounts.people)
    yield account.tokens_router(dss.accounts.people)
    yield routes.service_worker_router()
