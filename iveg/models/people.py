"""People, marks of operators, and detections, live and remembered."""

from typing import Annotated, Literal, Self

from pydantic import Field

from iveg.domain.parameters import Class
from iveg.domain.records import DetectionRecord
from iveg.domain.tracking import person
from iveg.domain.tracking.looks import Looks
from iveg.domain.tracking.people import Placed
from iveg.domain.tracking.person import Stage
from iveg.domain.transports import TransportId
from iveg.models.base import (
    OR_NONE,
    Model,
    Position,
    Row,
    Stamp,
    Thousandth,
    row_of,
)


class Acting(Model):
    """A robot that is slowed for somebody.

    Attributes:
        robot_id: The robot.
        distance_m: To the centre of the zone (m).
        in_sight: Whether the robot could see them itself.
    """

    robot_id: str
    distance_m: Thousandth
    in_sight: bool


class Evidence(Model):
    """All looks at somebody, and what they come to.

    All looks at somebody, by every robot, and what they come to
    ([safety.md](../safety.md), "The rule").

    Attributes:
        looks: Number of looks; 0.3 s of pictures of a robot are one.
        most: Confidence of the faintest and the surest (0–1).
        probability: That it is a person (0–1).
    """

    looks: int
    least: float = Field(description="Confidence of the faintest look (0 to 1).")
    most: float
    over_s: float = Field(description="From the first look to the newest.")
    probability: float

    @classmethod
    def of(cls, looks: Looks | None) -> Self | None:
        """Evidence of these looks; None where nothing adds up."""
        if looks is None:
            return None
        return cls.from_value(
            looks, looks=looks.count, probability=round(looks.probability, 4)
        )


class Person(Model):
    """A person, or a robot outside the fleet.

    A person, or a robot that does not belong to the fleet; one track.

    Attributes:
        person_id: The track: ``P`` (person) or ``R`` (robot), a number that starts anew
            each day (UTC), and a suffix that is new each day and at each start of iVeg,
            so that no id comes twice.
        class_: Canonical class.
        stage: ``seen`` ≤ 1 s, ``remembered`` ≤ 10 s, ``last_seen`` ≤ 10 min, or 1 min,
            and no longer than until the place was seen to be empty, of somebody who was
            never seen for 2.5 s at a time.
        position: In ``map`` (m).
        confidence: Of the newest detection; 0.5 of whom only a laser saw (0–1).
        first_seen: First and newest detection.
        last_seen: First and newest detection.
        age_s: Since the newest detection (s).
        observers: Robots that saw it.
        lane: Aisle in which it is.
        acting: Robots that are slowed for it.
    """

    person_id: str
    class_: Class = Field(validation_alias="class", serialization_alias="class")
    class_id: str = Field(description="The detector's own class name.")
    stage: Stage
    position: Position
    radius_m: float | None = Field(description="Radius of the widest zone.")
    confidence: float
    first_seen: Stamp
    last_seen: Stamp
    age_s: Thousandth
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
    thing_id: str | None = Field(
        description="The mark by which it is no person and has no zone."
    )


class Thing(Model):
    """One mark: who is born inside its circle and stays there slows nobody.

    Attributes:
        thing_id: The mark.
        kind: Always ``person``.
        y: Its middle in ``map`` (m).
        radius_m: 0.5, a constant (m).
        by: Who marked it.
        since: When.
    """

    thing_id: str
    kind: Literal["person"] = "person"
    x: Thousandth = Field(description="Of its middle in ``map``.")
    y: Thousandth
    radius_m: float = person.RADIUS_M
    by: str
    since: Stamp
    until: Stamp = Field(description="When it ends at the latest.")


class DetectionBox(Model):
    """A 3D box (m) in ``frame_id``.

    Attributes:
        xmin: Sides (m).
        xmax: Sides (m).
        ymin: Sides (m).
        ymax: Sides (m).
        zmin: Sides (m).
        zmax: Sides (m).
        frame_id: ``map`` or ``base_link``.
    """

    xmin: float
    xmax: float
    ymin: float
    ymax: float
    zmin: float
    zmax: float
    frame_id: str


@row_of(DetectionRecord)
class DetectionRow(Row):
    """One detection of the history.

    People's places are kept for ``IVEG_KEEP_POSITIONS_DAYS``
    ([deployment.md](../deployment.md), "How long the history keeps what"); then ``x``,
    ``y``, ``z`` and ``box`` are null.

    Attributes:
        box: As sent; null where it is no longer kept.
    """

    box: Annotated[DetectionBox | None, OR_NONE]


@row_of(DetectionRecord, "at", "x", "y", "z")
class Detection(Row):
    """One box of one detection frame, placed in ``map``.

    Attributes:
        position: Centre in ``map`` (m).
        box: As sent.
        peer: The robot of the fleet that was seen.
    """

    position: Position
    box: DetectionBox
    peer: str | None

    @classmethod
    def of(
        cls, one: Placed, robot_id: str, stamp: str | None, transport: TransportId
    ) -> Self:
        """One detection of a robot's newest frame."""
        x, y, z = one.position
        box = DetectionBox.from_value(one.framed.box, frame_id=one.framed.frame_id)
        return cls.from_value(
            one,
            robot_id=robot_id,
            stamp=stamp,
            class_id=one.detection.class_id,
            probability=one.detection.probability,
            position=Position(x=x, y=y, z=z),
            box=box,
            confident=one.kind != "faint",
            person_id=None if one.person is None else one.person.person_id,
            transport=transport,
        )


class DetectionFrame(Model):
    """Everything that one robot saw at one moment, faint detections included.

    Attributes:
        robot_id: The observer.
        stamp: As the robot sent it.
        transport: ``fiware`` or ``direct``, of the copy that was first.
        age_s: Of the frame (s).
        items: The detections.
    """

    robot_id: str
    stamp: str | None
    transport: TransportId
    age_s: Thousandth
    items: list[Detection]
