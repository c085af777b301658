"""People, and the robots that are slowed for them."""

from pydantic import Field

from iveg.domain.detection_rule import Class
from iveg.domain.tracking.looks import Looks
from iveg.domain.tracking.person import Stage
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
