"""The costmap over HTTP: numbers for programs and the page, a picture for people.

The picture is a PNG of shades of grey, white free and black taken, with the grey that
ROS map files use for unknown; its first line is the north.
"""

import asyncio
from io import BytesIO
from typing import Annotated

import numpy as np
import orjson
from fastapi import APIRouter, Depends, Query, Request, Response
from numpy.typing import NDArray
from PIL import Image

from iveg.domain.costmap import UNKNOWN, InflatedGrid
from iveg.domain.rule.zones import zones_of
from iveg.models.base import write_json
from iveg.models.mapped import Costmap as CostmapModel
from iveg.models.places import Point
from iveg.pipeline.evaluate import Evaluator
from iveg.pipeline.mapping import Mapper
from iveg.pipeline.ports import Clock
from iveg.web.refusals import refusals
from iveg.web.security.requirements import require

_PNG = "image/png"
_UNKNOWN_GREY = 205
_NOTHING = CostmapModel(
    resolution=0.1, width=0, height=0, origin=Point(x=0.0, y=0.0), data=[]
)


def router(mapper: Mapper, evaluator: Evaluator, clock: Clock) -> APIRouter:
    """Routes of the costmap."""
    routes = APIRouter(
        prefix="/api/v1", tags=["live"], dependencies=[Depends(require("read"))]
    )

    @routes.get(
        "/costmap",
        response_model=CostmapModel,
        responses={200: {"content": {_PNG: {}}}, **refusals(404)},
    )
    async def costmap(
        request: Request, robot: Annotated[str | None, Query(max_length=64)] = None
    ) -> Response:
        """The shared costmap, or what one robot believes.

        Rows from the south, 0 free to 100 taken, -1 unknown; a PNG where the caller
        accepts `image/png`.
        """
        now = clock()
        world = evaluator.world
        zones = zones_of(world, evaluator.people, evaluator.rule, now)
        if robot is None:
            found = mapper.shared(zones, now)
        else:
            found = mapper.of(world.robot(robot).robot_id, zones, now)
        headers = {"Vary": "Accept"}
        if _PNG in request.headers.get("accept", ""):
            body = await asyncio.to_thread(write_png, _shades(found))
            return Response(body, 200, headers, _PNG)
        age = mapper.age_s(robot, now)
        return Response(_json(found, age), 200, headers, "application/json")

    return routes


def _json(costmap: InflatedGrid | None, age_s: float | None) -> bytes:
    if costmap is None:
        return write_json(_NOTHING)
    grid = costmap.grid
    # Cells by the hundred thousand go as they are: the model names them, no more.
    members = {
        "resolution": round(grid.resolution, 6),
        "width": grid.width,
        "height": grid.height,
        "origin": {"x": grid.xmin, "y": grid.ymin},
        "data": costmap.data.reshape(-1),
        "age_s": None if age_s is None else round(age_s, 1),
    }
    return orjson.dumps(members, option=orjson.OPT_SERIALIZE_NUMPY)


def _shades(costmap: InflatedGrid | None) -> NDArray[np.uint8]:
    if costmap is None:
        return np.full((1, 1), _UNKNOWN_GREY, np.uint8)
    data = costmap.data
    shades = np.rint(255 - data.astype(np.float32) * 2.55).clip(0, 255).astype(np.uint8)
    shades[data == UNKNOWN] = _UNKNOWN_GREY
    return np.ascontiguousarray(shades[::-1])


def write_png(shades: NDArray[np.uint8]) -> bytes:
    """A picture of grey shades, shape (height, width), as a PNG (ISO 15948)."""
    file = BytesIO()
    Image.fromarray(shades).save(file, "png")
    return file.getvalue()
