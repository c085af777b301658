"""The evening sheet: one day of the fleet (docs/interfaces/resources.md)."""

from typing import Literal

from pydantic import Field

from iveg.models.base import Model
from iveg.models.command import Command
from iveg.models.places import GreenhouseMap, Point


class Worked(Model):
    """Minutes that one robot drove in one aisle."""

    lane: str
    robot_id: str
    minutes: float


class Slowed(Model):
    """Minutes of robots slowed, by what slowed them and the aisle that it was in."""

    cause: str = Field(description="``person`` or ``robot``; of a cost any reason.")
    lane: str | None = Field(description="Null: outside the aisles, or unknown.")
    minutes: float


class Encounters(Model):
    """How often a robot came to the ring of a person."""

    count: int
    slowed: int = Field(description="Of which the robot said that it was slow.")
    foretold: int = Field(description="Known before the robot was inside.")
    foretold_s: float | None = Field(description="How long before, on average.")


class Pass(Model):
    """A moving robot near a person; positions are means over a second."""

    at: str
    robot_id: str
    distance_m: float = Field(description="Between the middles of both.")
    speed: float
    robot: Point
    person: Point
    lane: str | None


class Day(Model):
    """Summary of one day of the fleet, Europe/Madrid, and what is due on the next."""

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
    stops: list[Command] = Field(description="STOPs and drills, oldest first.")
    drills_due: list[str] = Field(
        description="Robots whose STOP drill is due by the end of the next day."
    )
    unseen: int = Field(description="P1s that nobody has acknowledged.")
    lost: list[Literal["places", "telemetry"]] = Field(
        description=(
            "What of the day is no longer kept: places of people (no passes, no aisles "
            "of causes) or odometry and detections (nothing worked, no passes)."
        )
    )
    map: GreenhouseMap
