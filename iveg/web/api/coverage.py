"""Camera coverage over HTTP: the page shades the aisles by it."""

from fastapi import APIRouter, Depends, Response

from iveg.domain.coverage import RECENT_S
from iveg.domain.observations import Instant
from iveg.domain.stamps import format_stamp
from iveg.models.mapped import Coverage, LaneCoverage
from iveg.pipeline.coverage import CoverageMonitor
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import require


def router(monitor: CoverageMonitor, clock: Clock) -> APIRouter:
    """Routes of the camera coverage."""
    routes = APIRouter(
        prefix="/api/v1", tags=["live"], dependencies=[Depends(require("read"))]
    )

    @routes.get("/coverage", response_model=Coverage)
    async def coverage() -> Response:
        """When a camera last looked at each cell of the aisles; null: never.

        ``share`` of the cells (0-1) was looked at within ``within_s``; null where the
        greenhouse has no aisles.
        """
        now = clock()
        share = monitor.coverage.share(now)
        body = Coverage(
            at=format_stamp(now.wall),
            cameras=monitor.cameras(now),
            within_s=RECENT_S,
            share=None if share is None else round(share, 4),
            lanes=_lanes(monitor, now),
        )
        return Json(body)

    return routes


def _lanes(monitor: CoverageMonitor, now: Instant) -> list[LaneCoverage]:
    pairs = zip(monitor.coverage.lanes, monitor.coverage.ages(now), strict=True)
    return [
        LaneCoverage(
            label=one.lane.label,
            xmin=one.lane.area.xmin,
            ymin=one.lane.area.ymin,
            xmax=one.lane.area.xmax,
            ymax=one.lane.area.ymax,
            columns=one.columns,
            rows=one.rows,
            ages_s=ages,
        )
        for one, ages in pairs
    ]
