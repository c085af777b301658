"""Revoking robots over HTTP (docs/interfaces/http.md)."""

from fastapi import APIRouter, Response

from iveg.models.robot_access import RobotAccess
from iveg.pipeline.revocations import Revocations
from iveg.web.api.answers import Json
from iveg.web.refusals import refusals
from iveg.web.security.requirements import Admin


def router(revocations: Revocations) -> APIRouter:
    """For admins alone."""
    routes = APIRouter(prefix="/api/v1", tags=["robots"], responses=refusals(503))

    @routes.post("/robots/{robot_id}/revoke", response_model=RobotAccess)
    async def revoke(robot_id: str, who: Admin) -> Response:
        """STOP a robot, wait 3 s at most until it stands, and hear it no more."""
        return Json(RobotAccess.of(*await revocations.revoke(robot_id, who.name)))

    @routes.post("/robots/{robot_id}/allow", response_model=RobotAccess)
    async def allow(robot_id: str, who: Admin) -> Response:
        """Hear a robot again; it stays held until people release it."""
        return Json(RobotAccess.of(*await revocations.allow(robot_id, who.name)))

    return routes
