"""The web side of the server: routes of the present, of the past, and the pages."""

import asyncio
from collections.abc import Iterator
from pathlib import Path
from stat import S_ISREG

from anyio import to_thread
from fastapi import APIRouter, Depends, FastAPI
from starlette.datastructures import Headers
from starlette.responses import FileResponse, Response
from starlette.routing import Mount
from starlette.staticfiles import NotModifiedResponse, StaticFiles
from starlette.types import Scope

from iveg import __version__
from iveg.app.dss import Dss
from iveg.web.api import account, alerts, day, history, incidents
from iveg.web.api.answers import Json
from iveg.web.build import build_app, live_routers
from iveg.web.pages import drawing, routes
from iveg.web.security.requirements import require

_STATIC = Path(__file__).with_name("static")


def create_app(dss: Dss) -> FastAPI:
    """The web side of a DSS; its lifespan runs the rest."""
    pages = drawing.Pages(dss.web.site)
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
    yield alerts.notes_router(queries, dss.core.event_log.log, clock)
    yield account.router(dss.accounts.people)
    yield account.sessions_router()
    yield account.users_router(dss.accounts.people)
    yield account.tokens_router(dss.accounts.people)
    yield routes.service_worker_router()


class KeptFiles(StaticFiles):
    """Files of a folder from memory, as the first who asked for each found it.

    A page asks for some 200 at once.  Opened in threads for each request, they would
    hold up the loop on which a STOP runs for twice as long.
    """

    def __init__(self, folder: Path) -> None:
        super().__init__(directory=folder)
        self._kept: dict[str, Response] = {}

    async def get_response(self, path: str, scope: Scope) -> Response:
        """A whole file from memory; any other answer is the framework's own."""
        asked = Headers(scope=scope)
        if scope["method"] != "GET" or "range" in asked:
            return await super().get_response(path, scope)
        kept = self._kept.get(path) or await to_thread.run_sync(self._read, path)
        if kept is None:
            return await super().get_response(path, scope)
        self._kept[path] = kept
        if self.is_not_modified(kept.headers, asked):
            return NotModifiedResponse(kept.headers)
        return Response(kept.body, headers=kept.headers)

    def _read(self, path: str) -> Response | None:
        """The answer with a whole file; None for what is no file."""
        try:
            file, found = self.lookup_path(path)
            if found is None or not S_ISREG(found.st_mode):
                return None
            headers = FileResponse(file, stat_result=found).headers
            return Response(Path(file).read_bytes(), headers=headers)
        except (OSError, ValueError):
            return None
