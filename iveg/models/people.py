"""People, and what detectors saw of them."""

from pydantic import Field, ValidationError

from iveg.domain.detection_rule import Class
from iveg.domain.geometry import Box3D
from iveg.domain.records import DetectionRecord, Json
from iveg.domain.stamps import format_stamp
from iveg.domain.tracking.looks import Looks
from iveg.domain.tracking.people import Placed
from iveg.domain.tracking.person import Stage
from iveg.domain.transports import TransportId
from iveg.models.base import Model
from iveg.models.margin import Margin
from iveg.models.places import Position


class Acting(Model):
    """A robot that is slowed for somebody."""

    robot_id: str
    distance_m: float
    in_sight: bool


class Evidence(Model):
    """All looks at somebody, and what they come to."""

    looks: int
    least: float = Field(description="Confidence of the faintest look (0 to 1).")
    most: float
    over_s: float = Field(description="From the first look to the newest.")
    probability: float

    @classmethod
    def of(cls, looks: Looks | None) -> "Evidence | None":
        """What is known; None where nothing adds up."""
        if looks is None:
            return None
        return cls(
            looks=looks.count,
            least=looks.least,
            most=looks.most,
            over_s=looks.over_s,
            probability=round(looks.probability, 4),
        )


class Person(Model):
    """A person, or a robot outside the fleet."""

    person_id: str
    class_: Class = Field(validation_alias="class", serialization_alias="class")
    class_id: str = Field(description="The detector's own class name.")
    stage: Stage
    position: Position
    radius_m: float | None = Field(description="Radius of the widest ring.")
    confidence: float
    first_seen: str
    last_seen: str
    age_s: float
    observers: list[str]
    possible: bool = Field(description="Below the threshold but seen again and again.")
    evidence: Evidence | None = Field(
        description="All looks by the newest detection; None of a robot."
    )
    doubtful: bool = Field(
        description="Seen beyond the walls: the position is its observer's."
    )
    decision_id: str | None = Field(
        description="Newest open decision about this person."
    )
    lane: str | None
    acting: list[Acting]
    margin: Margin | None
    thing_id: str | None = Field(
        description="The mark by which it is no person and has no ring."
    )


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
