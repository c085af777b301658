"""Everything that is known, for a browser that has just connected."""

from typing import Self

from iveg.domain.audit import Actor
from iveg.domain.equipment import State, TileStatus
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
    members_of,
)
from iveg.models.command import Command
from iveg.models.health import Health
from iveg.models.history import Alert, LogEntry
from iveg.models.people import DetectionFrame, Person
from iveg.models.robot import Robot
from iveg.models.rule import Rule


@members_of(DomainClimate, "temperature", "relative_humidity", "co2")
class Climate(Model):
    """The newest reading of the air; null where a sensor is silent.

    Attributes:
        temperature: °C.
        relative_humidity: 0 to 1.
        co2: ppm.
        received_at: When iVeg took it.
        age_s: Since then (s).
    """

    received_at: Stamp
    age_s: Thousandth

    @classmethod
    def from_climate(
        cls, climate: DomainClimate, received: Instant, now: Instant
    ) -> Self:
        """The newest reading, with its age at this moment."""
        return cls.from_value(
            climate, received_at=received, age_s=now.mono - received.mono
        )


@members_of(DomainTile, "entity_id", "attribute", "unit", "decimals", "limits")
class Tile(Model):
    """One attribute of one entity, with its newest number.

    Attributes:
        key: Entity and attribute.
        entity_id: The entity at Orion.
        attribute: Its attribute.
        name: What people call it, by language.
        unit: Of ``value`` and ``limits``; ``1``: none.
        decimals: That people are shown.
        limits: ``low_low``, ``low``, ``high``, ``high_high``, those that it has (its
            unit).
        state: [equipment.md](../equipment.md), "States".
        value: The newest number; null before the first.
        received_at: When iVeg took it.
        age_s: Since then (s).
        trend: Its last 24 hours are drawn.
        place: Of its mark on the map.
    """

    key: str
    name: dict[Language, str]
    state: State
    value: float | None
    received_at: Stamp | None
    age_s: Thousandth | None
    trend: bool
    place: Point | None

    @classmethod
    def from_tile(
        cls, tile: DomainTile, status: TileStatus, state: State, now: Instant
    ) -> Self:
        """A tile with its newest number, at this moment."""
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
        boot: Random, new at each start.
        version: Of iVeg.
        demo: Started by ``iveg demo``.
        wall: Its clock (Unix s).
    """

    boot: str
    version: str
    demo: bool
    wall: float


@members_of(Actor, "name", "role")
class User(Model):
    """The signed-in user."""


class World(Model):
    """Everything that is known of the fleet and about it.

    Attributes:
        rule: As ``GET /rule``.
        map: As ``GET /map``.
        robots: All robots.
        people: All people.
        detections: By robot id.
        commands: Those that go on.
        alerts: As the topic.
        log: The newest 200, oldest first.
        health: As the topic.
        climate: As the topic.
        equipment: As the topic.
    """

    rule: Rule
    map: GreenhouseMap
    robots: list[Robot]
    people: list[Person]
    detections: dict[str, DetectionFrame]
    commands: list[Command]
    alerts: list[Alert]
    log: list[LogEntry]
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
        at: Moment of the picture: the newest that is not after the moment asked for.
        at_s: The same moment (Unix s).
        left_out: Topics of the recording that this version does not know.
        scans: Newest of each robot.
    """

    at: str
    at_s: float
    left_out: list[str]
    scans: list[Scan]
