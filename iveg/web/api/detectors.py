"""Detectors in and out of service over HTTP (docs/interfaces/http.md)."""

from fastapi import APIRouter, Response

from iveg.models.base import Body
from iveg.models.robot import Detector
from iveg.pipeline.detectors import Detectors
from iveg.pipeline.ports import Clock
from iveg.web.api.answers import Json
from iveg.web.refusals import refusals
from iveg.web.security.requirements import Operator


class ServiceRequest(Body):
    """Whether the detector is to be waited for."""

    in_service: bool


def router(detectors: Detectors, clock: Clock) -> APIRouter:
    """The word of an operator on a robot's detector."""
    routes = APIRouter(prefix="/api/v1", tags=["robots"])

    @routes.put(
        "/robots/{robot_id}/detector", response_model=Detector, responses=refusals(503)
    )
    async def service(
        robot_id: str,
        body: ServiceRequest,
        who: Operator,
    ) -> Response:
        """Take a detector out of service until its robot's next boot, or put it back.

        While it is out of service nobody waits for its pictures.
        """
        now = clock()
        robot = await detectors.set_in_service(
            robot_id, who.name, now, in_service=body.in_service
        )
        return Json(Detector.of(robot, now))

    return routes
