"""Goals of robots (docs/interfaces/http.md), which never delay a STOP."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.comfort.goals import GoalDispatcher
from iveg.domain.goals import GoalWish
from iveg.models.robot import Goal
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import Operator

# Beyond any map: the place is checked for the robot later (409).
_Metres = Annotated[float, Field(ge=-1e6, le=1e6)]


class _Wish(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


class HereRequest(_Wish):
    """A place in ``map`` (m)."""

    kind: Literal["here"]
    x: _Metres
    y: _Metres


class AisleRequest(_Wish):
    """An aisle by its label."""

    kind: Literal["aisle"]
    aisle: Annotated[str, Field(min_length=1, max_length=64)]


class PlainRequest(_Wish):
    """Return to the robot's start, or stay at its place."""

    kind: Literal["return", "pause"]


GoalRequest = Annotated[
    HereRequest | AisleRequest | PlainRequest, Field(discriminator="kind")
]


def router(goals: GoalDispatcher, clock: Clock) -> APIRouter:
    """Goals of robots."""
    routes = APIRouter(prefix="/api/v1", tags=["commands"])

    @routes.post("/robots/{robot_id}/goal", status_code=202, response_model=Goal)
    async def give(robot_id: str, body: GoalRequest, who: Operator) -> Response:
        """Send a robot somewhere; 409 while it is held or the place is not free."""
        return Json(
            Goal.from_goal(
                goals.give(robot_id, GoalWish(**body.model_dump()), who.name, clock())
            ),
            202,
        )

    @routes.delete("/robots/{robot_id}/goal", status_code=202, response_model=Goal)
    async def cancel(robot_id: str, who: Operator) -> Response:
        """Have a robot forget its goal and stay; 409 without a goal."""
        return Json(Goal.from_goal(goals.cancel(robot_id, who.name, clock())), 202)

    return routes
