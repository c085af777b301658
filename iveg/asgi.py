"""The web face of the DSS: the routes of now, of the past, and the pages."""

import asyncio
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from fastapi import APIRouter, Depends, FastAPI
from starlette.routing import Mount

from iveg import __version__
from iveg.adapters.pdf import find_browser
from iveg.app.dss import Dss
from iveg.app.laboratory import find_laboratory
from iveg.web.api import (
    account,
    cost,
    day,
    history,
    incidents,
    notes,
    passkeys,
    proof,
    sessions,
    sign_in_code,
    stop_records,
    tablet,
    tokens,
    users,
    what_if,
)
from iveg.web.api.answers import Json
from iveg.web.build import build_app, live_routers
from iveg.web.pages import drawing, openapi, routes, service_worker, sign_on
from iveg.web.security.requirements import require
from iveg.web.static_files import KeptFiles

_STATIC = Path(__file__).with_name("static")


def create_app(dss: Dss) -> FastAPI:
    """The web face of a DSS; its lifespan runs the rest."""
    # Whoever has the link needs no admin.
    pages = drawing.Pages(
        dss.face.site, lambda: dss.face.site.link or dss.door.people.is_led()
    )
    app = build_app(
        dss.face,
        pages,
        [*(make() for make in live_routers(dss.face)), *_past_routers(dss, pages)],
        title="iVeg",
        version=__version__,
        description="Supervise mixed robot fleets in greenhouses.",
        lifespan=dss.running,
    )
    of_pages = routes.router(
        pages,
        document=cache(lambda: openapi.describe_api(app)),
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
    """History, what a browser needs besides, and the laboratory's own."""
    queries, face = dss.stores.queries, dss.face
    views, evaluator, clock = face.views, dss.pipeline.evaluator, face.clock
    yield stop_records.router(queries, clock, views.find_command)
    url, greenhouse, worker = queries.url, evaluator.greenhouse, dss.worker
    run, due = worker.run, dss.settings.drill_days
    yield day.router(
        lambda *asked: run(day.read_day, url, greenhouse, due, *asked), pages, clock
    )
    braking = {
        robot_id: one.profile.assumed_braking
        for robot_id, one in dss.fleet.members.items()
    }
    yield cost.router(
        lambda *asked: run(cost.read_cost, url, greenhouse, braking, *asked),
        pages,
        clock,
    )
    yield history.router(
        queries,
        worker,
        threshold=lambda: evaluator.rule.threshold,
        present=evaluator.decision_record,
        flood=views.flood,
        fleet=dss.fleet,
    )
    yield incidents.router(
        incidents.Sources(
            queries,
            dss.stores.inputs,
            dss.packer,
            lambda: dss.services.rules.versions,
            dss.settings.without_secrets(),
            dss.pipeline.event_log.log,
            clock,
            __version__,
            find_browser(),
        )
    )
    yield what_if.router(dss.what_ifs, dss.services.rules, clock, worker)
    yield notes.router(queries, dss.fleet.members, dss.pipeline.event_log.log, clock)
    if dss.sign_in_token:
        yield sign_in_code.router(dss.sign_in_token)
    yield account.router(dss.door.people)
    yield sessions.router()
    yield users.router(dss.door.people, clock)
    yield tokens.router(dss.door.programs, clock)
    yield passkeys.router(dss.door.people, dss.door.passkeys)
    yield proof.router(dss.door.people, dss.door.passkeys, dss.door.pins)
    yield tablet.router(dss.door.people, dss.door.pins)
    if dss.sign_on is not None:
        yield sign_on.router(pages, dss.sign_on)
    yield service_worker.router()
    laboratory = find_laboratory("pages")
    if laboratory is not None:
        yield from laboratory.routers(dss, pages)
