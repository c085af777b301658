"""REST copies of live topics (docs/interfaces/http.md), costmap and camera coverage."""

from typing import Annotated

import orjson
from fastapi import APIRouter, Query, Response

from iveg.comfort.maps import CoverageMonitor, Mapper
from iveg.domain.costmap import InflatedGrid
from iveg.domain.coverage import RECENT_S
from iveg.domain.observations import Instant
from iveg.domain.rule.zones import zones_of
from iveg.domain.stamps import format_stamp
from iveg.models.base import Costmap as CostmapModel
from iveg.models.base import (
    Coverage,
    GreenhouseMap,
    LaneCoverage,
    Listing,
    Point,
    Scan,
    write_json,
)
from iveg.models.health import Health
from iveg.models.people import Person
from iveg.models.robot import Robot
from iveg.models.snapshot import Climate, Tile
from iveg.vital.evaluate import Evaluator
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import READERS
from iveg.web.views import Views

_NOTHING = CostmapModel(
    resolution=0.1, width=0, height=0, origin=Point(x=0.0, y=0.0), data=[]
)


def router(views: Views, clock: Clock) -> APIRouter:
    """Routes of the present state."""
    routes = APIRouter(prefix="/api/v1", tags=["live"], dependencies=READERS)

    @routes.get("/robots", response_model=Listing[Robot])
    async def robots() -> Response:
        """The whole fleet, each robot with the age of its data."""
        return Json(Listing(items=views.robots(clock())))

    @routes.get("/robots/{robot_id}", response_model=Robot)
    async def robot(robot_id: str) -> Response:
        """One robot."""
        return Json(views.robot(robot_id, clock()))

    @routes.get("/robots/{robot_id}/scan", response_model=Scan)
    async def scan(robot_id: str) -> Response:
        """The newest sweep of one robot, as points in `map`."""
        return Json(views.scan(robot_id))

    @routes.get("/people", response_model=Listing[Person])
    async def people() -> Response:
        """Every known person, in their three stages."""
        return Json(Listing(items=views.people(clock())))

    @routes.get("/map", response_model=GreenhouseMap)
    async def greenhouse() -> Response:
        """The greenhouse: lanes, crop rows, posts, obstacles (m)."""
        return Json(views.map())

    @routes.get("/climate", response_model=Climate | None)
    async def climate() -> Response:
        """The newest reading of the air; null before the first."""
        return Json(views.climate(clock()))

    @routes.get("/health", response_model=Health)
    async def chain() -> Response:
        """The data path from robot to screen, hop by hop, and the counters."""
        return Json(views.health(clock()))

    @routes.get("/equipment", response_model=Listing[Tile])
    async def equipment() -> Response:
        """Tiles of other equipment, each with its newest number and state."""
        return Json(Listing(items=views.equipment(clock())))

    return routes


def cells_router(
    mapper: Mapper, evaluator: Evaluator, monitor: CoverageMonitor, clock: Clock
) -> APIRouter:
    """Routes of costmaps and camera coverage."""
    routes = APIRouter(prefix="/api/v1", tags=["live"], dependencies=READERS)

    @routes.get(
        "/costmap",
        response_model=CostmapModel,
    )
    async def costmap(
        robot: Annotated[str | None, Query(max_length=64)] = None,
    ) -> Response:
        """The shared costmap, or the costmap of one robot.

        Rows from the south, 0 free to 100 taken, -1 unknown.
        """
        now = clock()
        world = evaluator.world
        zones = zones_of(world, evaluator.people, evaluator.rule, now)
        if robot is None:
            grid = mapper.shared(zones, now)
        else:
            # Through the world, which refuses an unknown robot (404).
            grid = mapper.of_robot(world.robot(robot).robot_id, zones, now)
        body = _json(grid, mapper.age_s(robot, now))
        return Response(body, media_type="application/json")

    @routes.get("/coverage", response_model=Coverage)
    async def coverage() -> Response:
        """Time of the last view of each cell of the aisles; null: never.

        ``share`` of the cells (0-1) was in view within ``within_s``; null where the
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


def _json(costmap: InflatedGrid | None, age_s: float | None) -> bytes:
    if costmap is None:
        return write_json(_NOTHING)
    grid = costmap.grid
    # A costmap has up to 400,000 cells: no model checks each, orjson writes them.
    members = {
        "resolution": round(grid.resolution, 6),
        "width": grid.width,
        "height": grid.height,
        "origin": {"x": grid.xmin, "y": grid.ymin},
        "data": costmap.data.reshape(-1),
        "age_s": None if age_s is None else round(age_s, 1),
    }
    return orjson.dumps(members, option=orjson.OPT_SERIALIZE_NUMPY)


def _lanes(monitor: CoverageMonitor, now: Instant) -> list[LaneCoverage]:
    pairs = zip(monitor.coverage.lanes, monitor.coverage.ages(now), strict=True)
    return [
        LaneCoverage.from_value(
            cells.lane.area,
            label=cells.lane.label,
            columns=cells.columns,
            rows=cells.rows,
            ages_s=ages,
        )
        for cells, ages in pairs
    ]
