"""The paper's latency table, live, beside its own numbers (docs/interfaces/http.md)."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from iveg.domain.latency.account import collect, merge
from iveg.domain.latency.watch import LatencyWatch
from iveg.models.latency import LatencyTable
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Apart
from iveg.web.api.exports import MEDIA_TYPES, form_of
from iveg.web.api.latency_table import (
    Asked,
    members_of,
    sampled_hops,
    write_csv,
    write_table,
)
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require


def router(watch: LatencyWatch, clock: Clock, worker: Apart) -> APIRouter:
    """Routes of the latency table."""
    routes = APIRouter(
        prefix="/api/v1",
        tags=["latency"],
        dependencies=[Depends(require("read"))],
        responses=refusals(503),
    )

    @routes.get(
        "/latency",
        response_model=LatencyTable,
        responses={200: {"content": {MEDIA_TYPES["csv"]: {}}}},
    )
    async def latency(request: Request, asked: Annotated[Asked, Query()]) -> Response:
        """Mean and quantiles of each hop, clocks, rates, loss, and the figures."""
        parts = collect(watch.streams, asked.window, asked.robot)
        form = asked.format or form_of(request.headers)
        if form == "csv":
            return Response(write_csv(await asyncio.to_thread(merge, parts)), 200, _CSV)
        streams = [one for one in watch.streams if asked.robot in (None, one.robot_id)]
        members = members_of(watch, streams, asked, clock())
        sampled = sampled_hops(streams)
        # A day of twenty robots is merged in a thread, as sending all of it to the
        # worker costs more; the figures of the sums are drawn there.
        sketches = await asyncio.to_thread(merge, parts)
        body = await worker.run(write_table, sketches, members, sampled, asked)
        return Response(body, media_type="application/json")

    return routes


_CSV = {
    "Content-Type": "text/csv; charset=utf-8",
    "Content-Disposition": 'attachment; filename="latency.csv"',
}
