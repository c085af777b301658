"""REST twins of live topics: robots, people, map, climate (docs/interfaces/http.md)."""

from fastapi import APIRouter, Depends, Response

from iveg.models.base import Listing
from iveg.models.climate import Climate
from iveg.models.device import Device
from iveg.models.health import Health
from iveg.models.mapped import Scan
from iveg.models.people import Person
from iveg.models.places import GreenhouseMap
from iveg.models.robot import Robot
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import require
from iveg.web.views import Views


def router(views: Views, clock: Clock) -> APIRouter:
    """Routes of the present state."""
    routes = APIRouter(
        prefix="/api/v1", tags=["live"], dependencies=[Depends(require("read"))]
    )

    @routes.get("/robots", response_model=Listing[Robot])
    async def robots() -> Response:
        """The whole fleet, each robot with the age of what is said of it."""
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

    @routes.get("/devices", response_model=Listing[Device])
    async def devices() -> Response:
        """Each robot's devices at the IoT Agent, and the time of their last message."""
        return Json(Listing(items=views.devices(clock())))

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

    return routes
