"""Everything that is known, for a browser that has just come; air and equipment."""

from typing import Self

from pydantic import Field

from iveg.domain.equipment import Limit, State, TileStatus
from iveg.domain.equipment import Tile as DomainTile
from iveg.domain.events import Language
from iveg.domain.observations import Climate as DomainClimate
from iveg.domain.observations import Instant
from iveg.models.base import (
    GreenhouseMap,
    Model,
    Point,
    Scan,
    Stamp,
    Thousandth,
)
from iveg.models.command import Command
from iveg.models.health import Health
from iveg.models.history import Alert, LogEntry
from iveg.models.people import DetectionFrame, Person
from iveg.models.robot import Robot
from iveg.models.rule import Rule


class Climate(Model):
    """The newest reading of the air; null where a sensor is silent.

    Attributes:
        received_at: When iVeg took it.
        age_s: Since then (s).
    """

    temperature: float | None = Field(description="°C.")
    relative_humidity: float | None = Field(description="0 to 1.")
    co2: float | None = Field(description="ppm.")
    received_at: Stamp
    age_s: Thousandth

    @classmethod
    def of(cls, read: DomainClimate, received: Instant, now: Instant) -> Self:
        """As it came in."""
        return cls.from_value(
            read, received_at=received, age_s=now.mono - received.mono
        )


class Tile(Model):
    """One attribute of one entity, with its newest number.

    Attributes:
        entity_id: The entity at Orion.
        attribute: Its attribute.
        name: What people call it, by language.
        unit: Of ``value`` and ``limits``; ``1``: none.
        decimals: That people are shown.
        limits: ``low_low``, ``low``, ``high``, ``high_high``, those that it has (its
            unit).
        state: [equipment.md](../equipment.md), "States".
        received_at: When iVeg took it.
        age_s: Since then (s).
        trend: Its last 24 hours are drawn.
        place: Of its mark on the map.
    """

    key: str = Field(description="Entity and attribute.")
    entity_id: str
    attribute: str
    name: dict[Language, str]
    unit: str
    decimals: int
    limits: dict[Limit, float]
    state: State
    value: float | None = Field(description="The newest number; null before the first.")
    received_at: Stamp | None
    age_s: Thousandth | None
    trend: bool
    place: Point | None

    @classmethod
    def of(
        cls, tile: DomainTile, status: TileStatus, state: State, now: Instant
    ) -> Self:
        """As it stands now."""
        received, place = status.received, tile.place
        return cls.from_value(
            tile,
            state=state,
            value=status.value,
            received_at=received,
            age_s=None if received is None else now.mono - received.mono,
            trend=tile.has_trend,
            place=None if place is None else Point(x=place[0], y=place[1]),
        )


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
    left_out: list[str] = Field(
        description="Topics of the recording that this version does not know."
    )
    scans: list[Scan]
