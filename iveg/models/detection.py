"""Detections of robots' cameras, live and remembered."""

from pydantic import Field, ValidationError

from iveg.domain.geometry import Box3D
from iveg.domain.records import DetectionRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.domain.tracking.people import Placed
from iveg.domain.transports import TransportId
from iveg.models.base import Model
from iveg.models.places import Position


class DetectionBox(Model):
    """A 3D box (m) in ``frame_id``."""

    xmin: float
    xmax: float
    ymin: float
    ymax: float
    zmin: float
    zmax: float
    frame_id: str

    @classmethod
    def of(cls, box: Box3D, frame_id: str) -> "DetectionBox":
        """As the detector reported it."""
        return cls(
            xmin=box.xmin,
            xmax=box.xmax,
            ymin=box.ymin,
            ymax=box.ymax,
            zmin=box.zmin,
            zmax=box.zmax,
            frame_id=frame_id,
        )


class KeptDetection(Model):
    """One box of one detection frame, as it is remembered."""

    robot_id: str
    stamp: str | None
    received_at: str | None = Field(
        default=None,
        description=(
            "When it reached iVeg; null on ``/live``, where its frame has an age."
        ),
    )
    class_: str | None = Field(validation_alias="class", serialization_alias="class")
    class_id: str
    probability: float
    position: Position | None = Field(
        description="Null in the history, where it is no longer kept."
    )
    box: DetectionBox | None
    confident: bool
    person_id: str | None
    peer: str | None = Field(
        default=None, description="The robot of the fleet that was seen."
    )
    transport: TransportId = Field(description="Transport of the copy that was first.")

    @classmethod
    def of_record(cls, record: DetectionRecord) -> "KeptDetection":
        """One detection as it is remembered."""
        return cls(
            robot_id=record.robot_id,
            stamp=record.stamp,
            received_at=format_stamp(record.at),
            class_=record.class_,
            class_id=record.class_id,
            probability=record.probability,
            position=_position(record),
            box=_box(record.box),
            confident=record.confident,
            person_id=record.person_id,
            transport=TransportId(record.transport),
        )


class DetectionRow(KeptDetection):
    """One detection of the history; what a CSV has beside the rest stands here too."""

    at: str = Field(description="As ``received_at``, under the name of the CSV.")
    x: float | None
    y: float | None
    z: float | None
    late: bool = Field(description="Sent after a gap; nothing acted on it.")

    @classmethod
    def of_row(cls, record: DetectionRecord) -> "DetectionRow":
        """One detection as it is remembered."""
        kept = dict(KeptDetection.of_record(record))
        at = format_stamp(record.at)
        x, y, z = record.x, record.y, record.z
        return cls(**kept, at=at, x=x, y=y, z=z, late=record.late)


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


def _position(record: DetectionRecord) -> Position | None:
    if record.x is None or record.y is None:
        return None
    return Position(x=record.x, y=record.y, z=record.z or 0.0)


def _box(found: Json | None) -> DetectionBox | None:
    """A remembered box; None where a row holds none that is whole."""
    try:
        return None if found is None else DetectionBox.model_validate(found)
    except ValidationError:
        return None


class DetectionFrame(Model):
    """Everything that one robot saw at one moment, faint detections included."""

    robot_id: str
    stamp: str | None
    transport: TransportId
    age_s: float
    items: list[Detection]
