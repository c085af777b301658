"""What limits cost over a range, and how near it was (docs/interfaces/resources.md)."""

from typing import Literal

from pydantic import Field

from iveg.models.base import Model
from iveg.models.day import Slowed
from iveg.models.places import GreenhouseMap, Point


class NearMiss(Model):
    """A driving robot within 1.5 m of somebody, from middle to middle."""

    at: str = Field(description="The nearest second.")
    robot_id: str
    distance_m: float = Field(description="By means over a second.")
    speed: float = Field(description="The greatest of that second.")
    seconds: int
    robot: Point
    lane: str | None
    decision_id: str | None = Field(description="What the robot was told then.")


class Heat(Point):
    """Seconds of near misses in one cell; x and y are its lower left corner."""

    seconds: int


class TaskCost(Model):
    """What limits cost a robot in one task, or outside of any."""

    robot_id: str
    command_id: str | None = Field(description="The goal; null: outside tasks.")
    state: str | None
    since: str | None
    until: str | None
    slowed_minutes: float
    held_minutes: float
    free_speed: float | None
    lost_m: float | None
    lost_minutes: float | None


class AlertCount(Model):
    """How often an alert was raised."""

    priority: str
    key: str
    count: int


class Cost(Model):
    """What limits cost over a range, and how near it was."""

    since: str
    until: str
    lost: list[Literal["places", "telemetry", "events"]] = Field(
        description="What of the range, or of a part of it, the history has not."
    )
    places_since: str | None = Field(description="The oldest that is kept.")
    telemetry_since: str | None
    events_since: str | None
    slowed: list[Slowed] | None
    near: list[NearMiss] | None = Field(description="The nearest, nearest first.")
    near_count: int | None
    heat: list[Heat] | None
    cell_m: float
    tasks: list[TaskCost] | None
    encounters: int | None
    encounters_slowed: int | None
    alerts: list[AlertCount] | None
    stops: int | None
    drills: int | None
    map: GreenhouseMap
