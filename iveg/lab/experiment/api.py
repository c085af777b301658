"""Experiments over HTTP: start, watch, stop, open."""

from pathlib import Path
from typing import Annotated, Literal, Protocol

from fastapi import APIRouter, Depends, HTTPException, Response
from fastapi import Path as InPath
from fastapi.responses import FileResponse, HTMLResponse
from pydantic import BaseModel, ConfigDict

from iveg.models.experiment import Experiment, Experiments
from iveg.web.api.answers import Json
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

Size = Literal["minimal", "quick", "full"]
Name = Annotated[str, InPath(pattern=r"^(minimal|quick|full)-\d{3}$")]
Running = [Depends(require("release"))]
_REPORT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
    "sandbox allow-scripts allow-modals"
)
"""A report brings its own script and style, so it is nobody's page: without our origin
it has neither cookie nor API."""


class ExperimentRunner(Protocol):
    """Port of the program that runs experiments."""

    def start(self, size: Size) -> Experiment:
        """Start one. Raises ExperimentRefusedError."""

    def stop(self) -> None:
        """End the one that runs."""

    def list(self) -> Experiments:
        """All, newest first."""

    def file(self, name: str, kind: str) -> Path | None:
        """A report (``html``) or a result (``json``)."""


class Wanted(BaseModel):
    """Which experiment."""

    model_config = ConfigDict(strict=True, extra="forbid")

    size: Size = "quick"
    """`quick` takes three minutes, `full` about 25, `minimal` some seconds."""


def router(bench: ExperimentRunner) -> APIRouter:
    """Read by all, started and stopped by operators."""
    routes = APIRouter(prefix="/api/v1", tags=["experiments"])
    reader = [Depends(require("read"))]

    @routes.get("/experiments", response_model=Experiments, dependencies=reader)
    def experiments() -> Response:
        """All experiments, newest first, and whether one may be started."""
        return Json(bench.list())

    @routes.post(
        "/experiments",
        status_code=202,
        response_model=Experiment,
        responses=refusals(409),
        dependencies=Running,
    )
    async def start(wanted: Wanted) -> Response:
        """Start one; 409 while one runs or a live robot is connected."""
        return Json(bench.start(wanted.size), 202)

    @routes.post(
        "/experiments/stop",
        status_code=202,
        response_model=Experiments,
        dependencies=Running,
    )
    async def stop() -> Response:
        """End the one that runs; it keeps what it has."""
        bench.stop()
        return Json(bench.list(), 202)

    @routes.get(
        "/experiments/{name}/report",
        response_class=HTMLResponse,
        dependencies=reader,
    )
    def report(name: Name) -> Response:
        """The report, or what an experiment that broke off left."""
        return FileResponse(
            _found(bench.file(name, "html")),
            media_type="text/html",
            headers={"Content-Security-Policy": _REPORT_POLICY},
        )

    @routes.get("/experiments/{name}/result", dependencies=reader)
    def result(name: Name) -> FileResponse:
        """All of its numbers, as JSON."""
        file = _found(bench.file(name, "json"))
        return FileResponse(file, filename=f"{name}.json")

    return routes


def _found(file: Path | None) -> Path:
    if file is None:
        raise HTTPException(404, "There is no such experiment, or nothing of it yet.")
    return file
