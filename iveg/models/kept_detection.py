"""Detections as they are remembered: one box of one frame."""

from pydantic import Field, ValidationError

from iveg.domain.geometry import Box3D
from iveg.domain.records import DetectionRecord, Json
from iveg.domain.stamps import format_stamp
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
            position=Position.of_record(record),
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


def _box(found: Json | None) -> DetectionBox | None:
    """A remembered box; None where a row holds none that is whole."""
    try:
        return None if found is None else DetectionBox.model_validate(found)
    except ValidationError:
        return None
