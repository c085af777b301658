"""STOP, release, resume (docs/interfaces/http.md).

STOP is accepted from everyone who is signed in, in any state, without limit.  Release
and resume are refused unless the robot stands and its report is fresh.
"""

from typing import Annotated

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, ConfigDict, Field

from iveg.models.command import FleetPressed, Pressed
from iveg.vital.command import Commander
from iveg.vital.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.presses import DESCRIBED, press_of
from iveg.web.security.requirements import Operator, Presser

HoldId = Annotated[str, Field(min_length=1, max_length=64)]


class ReleaseRequest(BaseModel):
    """The holds that the person saw."""

    model_config = ConfigDict(strict=True, extra="ignore")

    holds: Annotated[list[HoldId], Field(min_length=1, max_length=64)]


def router(commander: Commander, clock: Clock) -> APIRouter:
    """Routes of STOP, release and resume."""
    routes = APIRouter(prefix="/api/v1", tags=["commands"])

    @routes.post(
        "/robots/{robot_id}/stop",
        status_code=202,
        response_model=Pressed,
        openapi_extra=DESCRIBED,
    )
    async def stop(request: Request, robot_id: str, who: Presser) -> Response:
        """STOP one robot, on every transport at once."""
        # Read by hand: a declared body could be refused (422), and a STOP never is.
        press = await press_of(request)
        pressed = await commander.stop([robot_id], who.name, clock(), press)
        return Json(Pressed.from_value(pressed[0]), 202)

    @routes.post(
        "/fleet/stop",
        status_code=202,
        response_model=FleetPressed,
        openapi_extra=DESCRIBED,
    )
    async def stop_fleet(request: Request, who: Presser) -> Response:
        """STOP every robot, in parallel."""
        press = await press_of(request)
        pressed = await commander.stop(commander.machines, who.name, clock(), press)
        return Json(
            FleetPressed(commands=[Pressed.from_value(command) for command in pressed]),
            202,
        )

    @routes.post(
        "/robots/{robot_id}/release",
        status_code=202,
        response_model=Pressed,
    )
    async def release(robot_id: str, body: ReleaseRequest, who: Operator) -> Response:
        """Lift exactly the holds that the person saw; 409 when they have changed."""
        command = await commander.release(robot_id, body.holds, who.name, clock())
        return Json(Pressed.from_value(command), 202)

    @routes.post(
        "/robots/{robot_id}/resume",
        status_code=202,
        response_model=Pressed,
    )
    async def resume(robot_id: str, who: Operator) -> Response:
        """Let a released robot drive again."""
        command = await commander.resume(robot_id, who.name, clock())
        return Json(Pressed.from_value(command), 202)

    return routes
