"""The evening sheet: one day of the fleet (docs/interfaces/resources.md)."""

from typing import Literal

from pydantic import Field

from iveg.models.base import GreenhouseMap, Model, Point
from iveg.models.command import Command


class Worked(Model):
    """Minutes that one robot drove in one aisle.

    Attributes:
        lane: Where and who.
        robot_id: Where and who.
    """

    lane: str
    robot_id: str
    minutes: float


class Slowed(Model):
    """Minutes of robots slowed, by what slowed them and the aisle that it was in."""

    cause: str = Field(description="``person`` or ``robot``.")
    lane: str | None = Field(description="Null: outside the aisles, or unknown.")
    minutes: float


class Encounters(Model):
    """How often a robot came to the ring of a person.

    How often a robot came to the ring of a person on that day, by the decisions of the
    history.

    Attributes:
        count: Encounters.
    """

    count: int
    slowed: int = Field(description="Of which the robot said that it was slow.")
    foretold: int = Field(description="Known before the robot was inside.")
    foretold_s: float | None = Field(description="How long before, on average.")


class Pass(Model):
    """A moving robot near a person; positions are means over a second.

    Attributes:
        at: When.
        robot_id: Who.
        speed: Of the robot (m/s).
        robot: Where (m).
        person: Where (m).
        lane: Aisle.
    """

    at: str
    robot_id: str
    distance_m: float = Field(description="Between the middles of both.")
    speed: float
    robot: Point
    person: Point
    lane: str | None


class Day(Model):
    """Summary of one day of the fleet, Europe/Madrid, and what is due on the next.

    What the fleet did on one day (Europe/Madrid), and what is due on the next. Poses
    are means over a second.

    Attributes:
        since: Its range; ``until`` is now while it goes on.
        robots: Who took part.
        worked: Minutes in each aisle.
        slowed: Minutes of limited speed.
        encounters: How often a robot came to the ring of a person.
        map: The greenhouse.
    """

    day: str = Field(description="ISO date.")
    since: str
    until: str = Field(
        description="The end of the day, or the moment of asking while it goes on."
    )
    robots: list[str]
    worked: list[Worked]
    slowed: list[Slowed]
    encounters: Encounters
    passes: list[Pass] = Field(description="The nearest, nearest first.")
    stops: list[Command] = Field(description="STOPs, oldest first.")
    unseen: int = Field(description="P1s that nobody has acknowledged.")
    lost: list[Literal["places", "telemetry"]] = Field(
        description=(
            "What of the day is no longer kept: places of people (no passes, no aisles "
            "of causes) or odometry and detections (nothing worked, no passes)."
        )
    )
    map: GreenhouseMap
