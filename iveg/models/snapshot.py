"""Everything that is known, for a browser that has just come."""

from pydantic import Field

from iveg.models.base import GreenhouseMap, Model, Scan
from iveg.models.command import Command
from iveg.models.equipment import Climate, Tile
from iveg.models.health import Health
from iveg.models.history import Alert, LogEntry
from iveg.models.people import DetectionFrame, Person
from iveg.models.robot import Robot
from iveg.models.rule import Rule


class Server(Model):
    """Which iVeg speaks.

    Attributes:
        version: Of iVeg.
        demo: Started by ``iveg demo``.
    """

    boot: str = Field(description="Random, new at each start.")
    version: str
    demo: bool
    wall: float = Field(description="Its clock (Unix s).")


class User(Model):
    """The signed-in user."""

    name: str
    role: str


class World(Model):
    """Everything that is known of the fleet and about it.

    Attributes:
        rule: As ``GET /rule``.
        map: As ``GET /map``.
        robots: All robots.
        people: All people.
        detections: By robot id.
        alerts: As the topic.
        health: As the topic.
        climate: As the topic.
        equipment: As the topic.
    """

    rule: Rule
    map: GreenhouseMap
    robots: list[Robot]
    people: list[Person]
    detections: dict[str, DetectionFrame]
    commands: list[Command] = Field(description="Those that go on.")
    alerts: list[Alert]
    log: list[LogEntry] = Field(description="The newest 200, oldest first.")
    health: Health
    climate: Climate | None
    equipment: list[Tile]


class Snapshot(World):
    """The first frame of ``/live``.

    Attributes:
        t: When.
        server: Who answers.
        user: Who asks.
    """

    t: str
    server: Server
    user: User


class PastWorld(World):
    """The world as it was at a recorded moment; ages are of that moment.

    The world as it was at a recorded moment: the keys of the [Snapshot](#snapshot), as
    pages were told of them then. Ages are of that moment.

    Attributes:
        scans: Newest of each robot.
    """

    at: str = Field(
        description="The moment that is shown: the newest by the one asked."
    )
    at_s: float = Field(description="The same (Unix s).")
    recorded_twice: bool = Field(
        description="Whether another recording has this moment, too: the server's clock"
        " was set back."
    )
    left_out: list[str] = Field(
        description="Topics of the recording that this version does not know."
    )
    scans: list[Scan]
