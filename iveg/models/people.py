"""People, marks of operators, and detections, live and from the history."""

from typing import Annotated, Literal, Self

from pydantic import Field

from iveg.domain.geometry import Box3D
from iveg.domain.parameters import Class
from iveg.domain.records import DetectionRecord
from iveg.domain.rule.zones import ZoneEntry
from iveg.domain.tracking import things
from iveg.domain.tracking.looks import Looks
from iveg.domain.tracking.people import Placed
from iveg.domain.tracking.tracker import Stage
from iveg.domain.transports import TransportId
from iveg.models.base import (
    OR_NONE,
    Model,
    Position,
    Row,
    Stamp,
    Thousandth,
    members_of,
    row_of,
)


@members_of(ZoneEntry, "robot_id", "in_sight")
class Acting(Model):
    """A robot that is slowed for somebody.

    Attributes:
        robot_id: The robot.
        distance_m: To the centre of the zone (m).
        in_sight: Whether the robot could see them itself.
    """

    distance_m: Thousandth


@members_of(Looks, "least", "most", "over_s")
class Evidence(Model):
    """All looks at a person, and their sum.

    All looks at a person, by every robot, and their sum
    ([safety.md](../safety.md), "The rule").

    Attributes:
        looks: Number of looks; 0.3 s of pictures of a robot are one.
        least: Confidence of the faintest look (0 to 1).
        most: Confidence of the surest look (0 to 1).
        over_s: From the first look to the newest (s).
        probability: That it is a person (0–1).
    """

    looks: int
    probability: float

    @classmethod
    def from_looks(cls, looks: Looks | None) -> Self | None:
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
        class_id: The detector's own class name.
        stage: ``seen`` ≤ 1 s, ``remembered`` ≤ 10 s, ``last_seen`` ≤ 10 min. Somebody
            who was never seen for 2.5 s at a time is ``last_seen`` for 1 min at most,
            and only until the place was seen to be empty.
        position: In ``map`` (m).
        radius_m: Radius of the widest zone.
        confidence: Of the newest detection; 0.5 where only a laser saw it (0–1).
        first_seen: First and newest detection.
        last_seen: First and newest detection.
        age_s: Since the newest detection (s).
        observers: Robots that saw it.
        possible: Below the threshold but seen again and again.
        evidence: All looks by the newest detection; None of a robot.
        doubtful: Seen beyond the walls: the position is its observer's.
        decision_id: Newest open decision about this person.
        lane: Aisle in which it is.
        acting: Robots that are slowed for it.
        thing_id: The mark by which it is no person and has no zone.
    """

    person_id: str
    class_: Class = Field(validation_alias="class", serialization_alias="class")
    class_id: str
    stage: Stage
    position: Position
    radius_m: float | None
    confidence: float
    first_seen: Stamp
    last_seen: Stamp
    age_s: Thousandth
    observers: list[str]
    possible: bool
    evidence: Evidence | None
    doubtful: bool
    decision_id: str | None
    lane: str | None
    acting: list[Acting]
    thing_id: str | None


@members_of(things.Thing, "thing_id", "by")
class Thing(Model):
    """One mark: a track that begins within its radius and stays there slows nobody.

    Attributes:
        thing_id: The mark.
        kind: Always ``person``.
        x: Its middle in ``map`` (m).
        y: Its middle in ``map`` (m).
        radius_m: 0.5, a constant (m).
        by: Who marked it.
        since: When.
        until: When it ends at the latest.
    """

    kind: Literal["person"] = "person"
    x: Thousandth
    y: Thousandth
    radius_m: float = things.RADIUS_M
    since: Stamp
    until: Stamp


@members_of(Box3D, "xmin", "xmax", "ymin", "ymax", "zmin", "zmax")
class _Box(Model):
    """Sides of a box.

    Attributes:
        xmin: Sides (m).
        xmax: Sides (m).
        ymin: Sides (m).
        ymax: Sides (m).
        zmin: Sides (m).
        zmax: Sides (m).
    """


class DetectionBox(_Box):
    """A 3D box (m) in ``frame_id``.

    Attributes:
        frame_id: ``map`` or ``base_link``.
    """

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
    def from_placed(
        cls, placed: Placed, robot_id: str, stamp: str | None, transport: TransportId
    ) -> Self:
        """One detection of a robot's newest frame."""
        x, y, z = placed.position
        box = DetectionBox.from_value(
            placed.framed.box, frame_id=placed.framed.frame_id
        )
        return cls.from_value(
            placed,
            robot_id=robot_id,
            stamp=stamp,
            class_id=placed.detection.class_id,
            probability=placed.detection.probability,
            position=Position(x=x, y=y, z=z),
            box=box,
            confident=placed.kind != "faint",
            person_id=None if placed.person is None else placed.person.person_id,
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
