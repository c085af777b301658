"""Goals of robots (docs/interfaces/http.md): below STOP, and nothing in its way."""

from typing import Annotated, Literal

from fastapi import APIRouter, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.comfort.goals import GoalDispatcher
from iveg.domain.goals import GoalWish
from iveg.models.robot import Goal
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.security.requirements import Operator

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
    """Back to where the robot belongs, or stay where it is."""

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
            Goal.of(
                goals.give(robot_id, GoalWish(**body.model_dump()), who.name, clock())
            ),
            202,
        )

    @routes.delete("/robots/{robot_id}/goal", status_code=202, response_model=Goal)
    async def cancel(robot_id: str, who: Operator) -> Response:
        """Have a robot forget its goal and stay where it is; 409 without one."""
        return Json(Goal.of(goals.cancel(robot_id, who.name, clock())), 202)

    return routes
