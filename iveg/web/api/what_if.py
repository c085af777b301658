"""What another rule would have done: asked, watched, drawn and ended over HTTP."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Final, Literal, Protocol, Self

from fastapi import APIRouter, Depends, HTTPException, Response
from orjson import Fragment
from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from iveg.domain.detection_rule import FORESIGHT_MOST_S, DetectionRule
from iveg.domain.limits import LIMITS
from iveg.domain.what_if.parameters import Parameters
from iveg.domain.what_if.questions import VALUES, Job, Question, Varied
from iveg.models.base import Listing, write_json
from iveg.models.what_if import WhatIf
from iveg.pipeline.ports import Clock
from iveg.pipeline.rules import Rules
from iveg.web.api.answers import Apart, Json
from iveg.web.api.history_filters import Moment
from iveg.web.pages import charts, plotly_library
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require
from iveg.web.security.roles import Principal

LONGEST_S: Final = 7 * 86_400.0
"""Places of people are kept for as long, unless settings say otherwise."""
_MOST_OUTSIDE_M, _MOST_AFTER_S = 2.0, 10.0


def _within(least: float, most: float) -> object:
    return Field(None, ge=least, le=most, allow_inf_nan=False, strict=True)


class Asked(BaseModel):
    """A range and what differs from the rule in force; what is left out does not."""

    model_config = ConfigDict(extra="forbid")

    since: Moment
    until: Moment
    confidence_threshold: Annotated[float | None, _within(0.0, 1.0)] = None
    radius_m: Annotated[
        float | None, _within(LIMITS.ring_least_m, LIMITS.ring_most_m)
    ] = None
    release_beyond_m: Annotated[float | None, _within(0.0, _MOST_OUTSIDE_M)] = None
    release_after_s: Annotated[float | None, _within(0.0, _MOST_AFTER_S)] = None
    factor: Annotated[float | None, _within(0.0, 1.0)] = None
    foresight_s: Annotated[float | None, _within(0.0, FORESIGHT_MOST_S)] = None
    vary: Literal[
        "confidence_threshold",
        "radius_m",
        "release_beyond_m",
        "release_after_s",
        "factor",
        "foresight_s",
    ] = "confidence_threshold"
    """The parameter of the curve."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.since >= self.until:
            raise PydanticCustomError("order", "since is not before until")
        if (self.until - self.since).total_seconds() > LONGEST_S:
            raise PydanticCustomError("length", "longer than seven days")
        return self

    def question(self, rule: DetectionRule) -> Question:
        """The question beside the rule in force."""
        in_force = parameters_of(rule)
        asked = self.model_dump(exclude={"since", "until", "vary"}, exclude_none=True)
        if "confidence_threshold" in asked:
            asked["threshold"] = asked.pop("confidence_threshold")
        candidate = replace(in_force, **asked)
        vary: Varied = "threshold" if self.vary == "confidence_threshold" else self.vary
        own = {getattr(one, vary) for one in (in_force, candidate)}
        return Question(
            self.since.timestamp(),
            self.until.timestamp(),
            in_force,
            candidate,
            vary,
            tuple(sorted({*VALUES[vary], *own})),
        )


def parameters_of(rule: DetectionRule) -> Parameters:
    """Those of a version of the rule."""
    return Parameters(
        rule.threshold_of("person"),
        rule.threshold_of("robot"),
        rule.radius_m,
        foresight_s=rule.foresight_s if rule.foresight else 0.0,
    )


class WhatIfs(Protocol):
    """Takes questions and answers them in a process: ``app.what_if``."""

    def ask(self, question: Question, by: str) -> Job:
        """Take a question.  Raises WhatIfRefusedError."""

    def find(self, job_id: str) -> Job:
        """A question by its id.  Raises UnknownNameError."""

    def newest(self) -> list[Job]:
        """Every question that is known, newest first."""

    def cancel(self, job_id: str, by: str | None) -> Job:
        """End a question.  Raises UnknownNameError."""


def router(what_ifs: WhatIfs, rules: Rules, clock: Clock, worker: Apart) -> APIRouter:
    """The routes; whoever may read may ask."""
    routes = APIRouter(
        prefix="/api/v1/what-if", tags=["rule"], responses=refusals(409, 503)
    )
    reader = Depends(require("read"))

    @routes.post("", response_model=WhatIf, status_code=202)
    async def ask(body: Asked, who: Annotated[Principal, reader]) -> Response:
        """Ask what another rule would have done over a range of the history."""
        if body.until.timestamp() > clock().wall:
            raise HTTPException(422, "The range ends in what is still to come.")
        job = what_ifs.ask(body.question(rules.current), who.name)
        return Json(WhatIf.of(job), 202)

    @routes.get("", response_model=Listing[WhatIf], dependencies=[reader])
    async def questions() -> Response:
        """The newest questions, without answers."""
        items = [WhatIf.of(replace(one, answer=None)) for one in what_ifs.newest()]
        return Json(Listing(items=items))

    @routes.get("/{job_id}", response_model=WhatIf, dependencies=[reader])
    async def question(job_id: str) -> Response:
        """A question, how far it is, and its answer."""
        return Json(WhatIf.of(what_ifs.find(job_id)))

    @routes.get("/{job_id}/figures", response_class=Response, dependencies=[reader])
    async def figures(job_id: str) -> Response:
        """The curve as Plotly figures; 404 until there is an answer."""
        job = what_ifs.find(job_id)
        if job.answer is None:
            raise HTTPException(404, "There is no answer yet.")
        return Response(
            await worker.run(draw, WhatIf.of(job)), media_type="application/json"
        )

    @routes.delete("/{job_id}", response_model=WhatIf)
    async def cancel(job_id: str, who: Annotated[Principal, reader]) -> Response:
        """End one's own question; operators end anybody's."""
        by = None if who.role in ("operator", "admin") else who.name
        return Json(WhatIf.of(what_ifs.cancel(job_id, by)))

    return routes


def draw(found: WhatIf) -> bytes:
    """The figures of an answer; in the worker."""
    curve = [] if found.answer is None else found.answer.curve
    minutes = {
        why: [point.outcome.slowed_s.get(why, 0.0) / 60.0 for point in curve]
        for why in ("person", "robot")
    }
    shown: dict[str, Mapping[str, Sequence[float]]] = {
        "minutes": minutes,
        "near_misses": {"near_misses": [one.outcome.near_misses for one in curve]},
    }
    if any(one.outcome.missed_s is not None for one in curve):
        shown["truth"] = {
            "missed": [(one.outcome.missed_s or 0.0) / 60.0 for one in curve],
            "false": [(one.outcome.false_s or 0.0) / 60.0 for one in curve],
        }
    values, in_force = [one.value for one in curve], getattr(found.in_force, found.vary)
    figures = {
        name: Fragment(
            charts.what_if_figure(
                values, lines, (f"what_if_{found.vary}", f"what_if_{name}"), in_force
            )
        )
        for name, lines in shown.items()
    }
    return write_json({**plotly_library.library_facts(), "figures": figures})
