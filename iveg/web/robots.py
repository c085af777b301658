"""REST twins of what is live: robots, people, map, climate (docs/interfaces.md §5)."""

from collections.abc import Callable

import orjson
from fastapi import APIRouter, Depends
from starlette.responses import Response
from typing_extensions import TypedDict

from iveg.domain.observations import Instant
from iveg.web import schemas
from iveg.web.auth import require
from iveg.web.views import Views


class Json(Response):
    """A JSON answer that is written once, by orjson."""

    media_type = "application/json"

    def render(self, content: object) -> bytes:
        """The bytes of the answer."""
        return orjson.dumps(content)


class RobotList(TypedDict):
    """A page of robots."""

    items: list[schemas.RobotJson]
    next: str | None


class PersonList(TypedDict):
    """A page of people."""

    items: list[schemas.PersonJson]
    next: str | None


def router(
    views: Views,
    clock: Callable[[], Instant],
    health: Callable[[Instant], schemas.HealthJson],
) -> APIRouter:
    """What is known now."""
    routes = APIRouter(
        prefix="/api/v1", tags=["live"], dependencies=[Depends(require("read"))]
    )

    @routes.get("/robots", response_model=RobotList)
    async def robots() -> Response:
        """The whole fleet, each robot with the age of what is said of it."""
        return Json({"items": views.robots(clock()), "next": None})

    @routes.get("/robots/{robot_id}", response_model=schemas.RobotJson)
    async def robot(robot_id: str) -> Response:
        """One robot."""
        return Json(views.robot(robot_id, clock()))

    @routes.get("/robots/{robot_id}/scan", response_model=schemas.ScanJson)
    async def scan(robot_id: str) -> Response:
        """The newest sweep of one robot, as points in `map`."""
        swept = views.scan(robot_id)
        points: list[list[float]] = []
        stamp = None
        if swept is not None:
            stamp = swept[0].origin.stamp
            points = [[round(x, 3), round(y, 3)] for x, y in swept[1].tolist()]
        body: schemas.ScanJson = {
            "robot_id": robot_id,
            "stamp": stamp,
            "frame_id": "map",
            "points": points,
        }
        return Json(body)

    @routes.get("/people", response_model=PersonList)
    async def people() -> Response:
        """Everyone who is known, in their three stages."""
        return Json({"items": views.people(clock()), "next": None})

    @routes.get("/map")
    async def greenhouse() -> Response:
        """The greenhouse: lanes, crop rows, posts, obstacles (m)."""
        return Json(views.map())

    @routes.get("/climate", response_model=schemas.ClimateJson | None)
    async def climate() -> Response:
        """The newest reading of the air; null before the first."""
        return Json(views.climate(clock()))

    @routes.get("/health", response_model=schemas.HealthJson)
    async def chain() -> Response:
        """The chain from robot to screen, hop by hop, and what was counted."""
        return Json(health(clock()))

    return routes
