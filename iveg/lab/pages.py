"""Page and routes of experiments, which the server adds where there is a laboratory."""

from collections.abc import Iterator

from fastapi import APIRouter
from fastapi.responses import HTMLResponse

from iveg.app.dss import Dss
from iveg.lab.experiment import api
from iveg.lab.experiment.runner import ExperimentRunner
from iveg.web.pages.drawing import Pages
from iveg.web.pages.routes import add_scripted


def routers(dss: Dss, pages: Pages) -> Iterator[APIRouter]:
    """Routes of this server's experiments, which end with the server."""
    runner = ExperimentRunner(dss.stores.directory / "experiments", dss.is_robot_there)
    dss.on_close.append(runner.close)
    yield api.router(runner)
    yield page(pages)


def page(pages: Pages) -> APIRouter:
    """The page of experiments."""
    routes = APIRouter(include_in_schema=False, default_response_class=HTMLResponse)
    add_scripted(routes, pages, "experiments", "/experiments")
    return routes
