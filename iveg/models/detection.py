"""Detections of robots' cameras as they come in."""

from iveg.domain.tracking.people import Placed
from iveg.domain.transports import TransportId
from iveg.models.base import Model
from iveg.models.kept_detection import DetectionBox, KeptDetection
from iveg.models.places import Position


class Detection(KeptDetection):
    """One box of one detection frame, placed in ``map``."""

    position: Position

    @classmethod
    def of(
        cls, one: Placed, robot_id: str, stamp: str | None, transport: TransportId
    ) -> "Detection":
        """One detection of a robot's newest frame."""
        x, y, z = one.position
        return cls(
            robot_id=robot_id,
            stamp=stamp,
            class_=one.class_,
            class_id=one.detection.class_id,
            probability=one.detection.probability,
            position=Position(x=x, y=y, z=z),
            box=DetectionBox.of(one.framed.box, one.framed.frame_id),
            confident=one.kind != "faint",
            person_id=None if one.person is None else one.person.person_id,
            peer=one.peer,
            transport=transport,
        )


class DetectionFrame(Model):
    """Everything that one robot saw at one moment, faint detections included."""

    robot_id: str
    stamp: str | None
    transport: TransportId
    age_s: float
    items: list[Detection]
