"""Everything that is known, for a browser that has just come."""

from pydantic import Field

from iveg.models.alert import Alert, Flood
from iveg.models.base import Model
from iveg.models.climate import Climate
from iveg.models.command import Command
from iveg.models.detection import DetectionFrame
from iveg.models.equipment import Tile
from iveg.models.health import Health
from iveg.models.log_entry import LogEntry
from iveg.models.mapped import Scan
from iveg.models.people import Person
from iveg.models.places import GreenhouseMap
from iveg.models.robot import Robot
from iveg.models.rule import Rule


class Server(Model):
    """Which iVeg speaks."""

    boot: str = Field(description="Random, new at each start.")
    version: str
    demo: bool
    wall: float = Field(description="Its clock (Unix s).")


class User(Model):
    """The signed-in user."""

    name: str
    role: str


class World(Model):
    """Everything that is known of the fleet and about it."""

    rule: Rule
    map: GreenhouseMap
    robots: list[Robot]
    people: list[Person]
    detections: dict[str, DetectionFrame]
    commands: list[Command] = Field(description="Those that go on.")
    alerts: list[Alert]
    flood: Flood
    log: list[LogEntry] = Field(description="The newest 200, oldest first.")
    health: Health
    climate: Climate | None
    equipment: list[Tile]


class Snapshot(World):
    """The first frame of ``/live``."""

    t: str
    server: Server
    user: User


class PastWorld(World):
    """The world as it was at a recorded moment; ages are of that moment."""

    at: str = Field(
        description="The moment that is shown: the newest by the one asked."
    )
    at_s: float = Field(description="The same (Unix s).")
    verified: bool | None = Field(
        description="Whether it has the hash that iVeg had then; null: none was passed."
    )
    recorded_twice: bool = Field(
        description="Whether another recording has this moment, too: the server's clock"
        " was set back."
    )
    scans: list[Scan]
