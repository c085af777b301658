"""What holds or slows a robot, and why."""

from typing import Literal

from pydantic import Field

from iveg.domain import feedback
from iveg.domain.observations import Instant
from iveg.domain.rule import foresight
from iveg.models.base import Model, rounded
from iveg.models.places import Point


class SpeedLimit(Model):
    """Greatest speed factor of a robot, and its reason."""

    speed_factor: float
    reason: str
    cause: str | None
    distance_m: float | None
    decision_id: str | None
    foretold_s: float | None = Field(
        description="Until it reaches the ring of the cause; null: it is inside."
    )

    @classmethod
    def of(cls, limit: feedback.SpeedLimit) -> "SpeedLimit":
        """The speed limit in force."""
        return cls(
            speed_factor=limit.speed_factor,
            reason=limit.reason,
            cause=limit.cause,
            distance_m=rounded(limit.distance_m),
            decision_id=limit.decision_id,
            foretold_s=rounded(limit.foretold_s),
        )


class Encounter(Model):
    """A zone that the robot will reach (docs/safety.md, "Foresight")."""

    cause: str
    reason: str
    in_s: float
    probability: float = Field(
        description="Share of encounters foretold so far ahead that came true."
    )
    place: Point = Field(description="Where the robot will be.")
    centre: Point = Field(description="Where the zone's centre will be.")
    radius_m: float

    @classmethod
    def of(cls, foretold: foresight.Encounter, now: Instant) -> "Encounter":
        """At this moment."""
        left_s = foretold.left_s(now)
        return cls(
            cause=foretold.zone.cause,
            reason=foretold.zone.reason,
            in_s=round(left_s, 1),
            probability=round(foresight.probability(left_s), 2),
            place=Point(x=round(foretold.x, 2), y=round(foretold.y, 2)),
            centre=Point(x=round(foretold.centre_x, 2), y=round(foretold.centre_y, 2)),
            radius_m=round(foretold.zone.radius_m, 2),
        )


class MissingPremise(Model):
    """One thing without which a robot is not clear (docs/safety.md, "Clear")."""

    premise: Literal["pose", "doubt", "detector"]
    robot_id: str = Field(description="Whose pose, word or detector it is.")
