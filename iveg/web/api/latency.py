"""The paper's latency table, live, beside its own numbers (docs/interfaces/http.md).

It is read in the loop from streams of measures; its figure is drawn in the worker.
"""

import asyncio
from dataclasses import asdict
from typing import Annotated

import orjson
from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.domain.clock_offset import ClockOffset
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
from iveg.web.api.answers import Apart, Json
from iveg.web.pages.charts import cdf_figure
from iveg.web.security.requirements import READERS


class Asked(BaseModel):
    """Robot of the question."""

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


def _clock(robot_id: str, offset: ClockOffset) -> LatencyClock:
    return LatencyClock(
        robot_id=robot_id,
        state=offset.state,
        offset_ms=in_ms(offset.offset_s),
        uncertainty_ms=in_ms(offset.uncertainty_s),
    )


def router(watch: LatencyWatch, clock: Clock, worker: Apart) -> APIRouter:
    """Routes of the latency table."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["latency"],
        dependencies=READERS,
    )

    @routes.get("/latency", response_model=LatencyTable)
    async def latency(asked: Annotated[Asked, Query()]) -> Response:
        """Mean and quantiles of each hop, clocks, and the figure."""
        now = clock()
        parts = collect(watch.streams, asked.robot)
        # What ten robots sent is merged in a thread, as sending all of it to the worker
        # costs more; the figure of the sums is drawn there.
        sketches = await asyncio.to_thread(merge, parts)
        figures: dict[str, object] = {}
        if asked.figures:
            figures["cdf"] = orjson.Fragment(await worker.run(cdf_figure, sketches))
        answer = LatencyTable(
            at=format_stamp(now.wall),
            robot=asked.robot,
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
                _clock(robot_id, one)
                for robot_id, one in watch.clocks.items()
                if asked.robot in (None, robot_id)
            ],
            figures=figures,
        )
        # Member by member, as only orjson knows what to do with a figure that is drawn.
        return Json(vars(answer))

    return routes
