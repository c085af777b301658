"""The paper's latency table, live, beside its own numbers (docs/interfaces/http.md).

It is read in the loop from streams of measures; its figure is drawn in the worker.
"""

import asyncio
from dataclasses import asdict
from typing import Annotated

import orjson
from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.adapters.worker import Worker
from iveg.domain.latency import (
    DATA,
    PAPER,
    SEGMENTS,
    LatencyWatch,
    Sketch,
    collect,
    merge,
)
from iveg.domain.stamps import format_stamp
from iveg.models.health import (
    LatencyClock,
    LatencyRow,
    LatencyTable,
    SegmentSpread,
    in_ms,
)
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.pages.charts import cdf_figure
from iveg.web.security.requirements import READERS


class LatencyQuery(BaseModel):
    """Parameters of a request for the table."""

    model_config = ConfigDict(extra="forbid")

    robot: str | None = Field(
        None, pattern=r"^[A-Za-z0-9-]{1,64}$", description="Robot id; all unless told"
    )
    figures: bool = Field(True, description="Whether to draw the distributions, too")


def _spread(sketch: Sketch) -> SegmentSpread:
    return SegmentSpread(
        count=sketch.count,
        mean_ms=in_ms(sketch.mean),
        p50_ms=in_ms(sketch.quantile(0.50)),
        p95_ms=in_ms(sketch.quantile(0.95)),
        p99_ms=in_ms(sketch.quantile(0.99)),
    )


def router(watch: LatencyWatch, clock: Clock, worker: Worker) -> APIRouter:
    """Routes of the latency table."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["latency"],
        dependencies=READERS,
    )

    @routes.get("/latency", response_model=LatencyTable)
    async def latency(query: Annotated[LatencyQuery, Query()]) -> Response:
        """Mean and quantiles of each hop, clocks, and the figure."""
        now = clock()
        parts = collect(watch.streams.values(), query.robot)
        # Merged in a thread: sending ten robots' sketches to the worker costs more.
        # Only the figure of the sums is drawn there.
        sketches = await asyncio.to_thread(merge, parts)
        figures: dict[str, object] = {}
        if query.figures:
            figures["cdf"] = orjson.Fragment(await worker.run(cdf_figure, sketches))
        answer = LatencyTable(
            at=format_stamp(now.wall),
            robot=query.robot,
            # Without it Δt₁ and Δt₂ cannot be told apart: FIWARE hides the boundary.
            direct=any(sketches[data, "uplink"].count for data in DATA),
            rows=[
                LatencyRow(
                    data=data,
                    hops={hop: _spread(sketches[data, hop]) for hop in SEGMENTS},
                )
                for data in DATA
            ],
            paper={
                place: {data: asdict(row) for data, row in rows.items()}
                for place, rows in PAPER.items()
            },
            clocks=[
                LatencyClock(
                    robot_id=robot_id,
                    state=offset.state,
                    offset_ms=in_ms(offset.offset_s),
                    uncertainty_ms=in_ms(offset.uncertainty_s),
                )
                for robot_id, offset in watch.clocks.items()
                if query.robot in (None, robot_id)
            ],
            figures=figures,
        )
        # Member by member, as only orjson knows what to do with a figure that is drawn.
        return Json(vars(answer))

    return routes
