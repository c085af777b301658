"""Live topics: name, model and source of each.

This table is the only place that spells a topic.  Vital parts name changed topics by
it (``ROBOT.for_id("AGI")``), ``/live`` reads and paces by it, and the snapshot is the
table read once.  Every event is sent; of a state only the newest value.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal

from iveg.domain.observations import Instant
from iveg.models.base import GreenhouseMap, Scan
from iveg.models.command import Command
from iveg.models.health import Health
from iveg.models.history import Alert, LogEntry
from iveg.models.people import DetectionFrame, Person
from iveg.models.robot import Robot
from iveg.models.rule import Rule
from iveg.models.snapshot import Climate, Tile

Pace = Literal["at once", "frame", "read-out", "picture"]
"""Pace: at once, before all telemetry; each frame; as digits; as pictures."""


StateReader = Any
"""Source of the newest value of every topic (``web.views.Views``)."""


@dataclass(frozen=True, slots=True, eq=False)
class Topic:
    """One row.

    Attributes:
        name: As docs/interfaces/live.md writes it; ``{id}`` is the key.
        model: Type of its data; None for topics of a single connection.
        tell: Makes the data of an event from its item.
        member: Its member of the snapshot.
        read: Reads that member; a state sent at once is read again on each change.
        pace: Pace at which a browser is sent it.
    """

    name: str
    model: Any = None
    tell: Callable[[StateReader, Any, Instant], Any] = lambda _, item, __: item
    member: str = ""
    read: Callable[[StateReader, Instant], Any] | None = None
    pace: Pace = "at once"

    def for_id(self, key: str) -> str:
        """Topic of the robot or command with this id."""
        return self.name.replace("{id}", key)


ROBOT = Topic(
    "robots/{id}",
    Robot,
    member="robots",
    read=lambda reader, now: reader.robots(now),
    pace="frame",
)
ROBOT_STATE = Topic("robots/{id}/state", Robot, pace="read-out")
"""Sent within frames alone: the state of a robot without its motion."""
SCAN = Topic("robots/{id}/scan", Scan, pace="picture")
"""Binary, so that ``web`` writes it (docs/interfaces/live.md)."""
PEOPLE = Topic(
    "people",
    list[Person],
    member="people",
    read=lambda reader, now: reader.people(now),
    pace="read-out",
)
DETECTIONS = Topic(
    "detections/{id}",
    DetectionFrame,
    member="detections",
    read=lambda reader, now: reader.frames(now),
    pace="picture",
)
COMMAND = Topic(
    "commands/{id}",
    Command,
    tell=lambda reader, command, now: reader.command(command, now),
    member="commands",
    read=lambda reader, now: reader.open_commands(now),
)
ALERTS = Topic(
    "alerts",
    list[Alert],
    member="alerts",
    read=lambda reader, _: reader.alerts(),
)
RULE = Topic(
    "rule",
    Rule,
    member="rule",
    read=lambda reader, _: reader.rule(),
)
MAP = Topic("map", GreenhouseMap, member="map", read=lambda reader, _: reader.map())
"""Sent in the snapshot alone: it does not change while iVeg runs."""
LOG = Topic(
    "log",
    LogEntry,
    tell=lambda _, line, __: LogEntry.from_record(line),
    member="log",
    read=lambda reader, _: reader.log_since(),
)
HEALTH = Topic(
    "health",
    Health,
    member="health",
    read=lambda reader, now: reader.health(now),
)
CLIMATE = Topic(
    "climate",
    Climate | None,
    member="climate",
    read=lambda reader, now: reader.climate(now),
)
EQUIPMENT = Topic(
    "equipment",
    list[Tile],
    member="equipment",
    read=lambda reader, now: reader.equipment(now),
)
SNAPSHOT = Topic("snapshot")
PONG = Topic("pong")
PROBLEM = Topic("problem")

TOPICS = (
    ROBOT,
    ROBOT_STATE,
    SCAN,
    PEOPLE,
    DETECTIONS,
    COMMAND,
    ALERTS,
    RULE,
    MAP,
    LOG,
    HEALTH,
    CLIMATE,
    EQUIPMENT,
    SNAPSHOT,
    PONG,
    PROBLEM,
)


# Each command has a topic of its own, so the cache must have a bound.
@lru_cache(maxsize=4096)
def find(topic: str) -> tuple[Topic, str]:
    """Row of a topic, and its key; empty where the topic has none.

    Raises:
        KeyError: no such topic.
    """
    for row in TOPICS:
        head, placeholder, tail = row.name.partition("{id}")
        if not placeholder and topic == row.name:
            return row, ""
        key = topic.removeprefix(head).removesuffix(tail)
        # ``robots/{id}`` must not take ``robots/{id}/scan`` with "A/scan" as its key.
        if placeholder and topic == row.for_id(key) and key and "/" not in key:
            return row, key
    raise KeyError(topic)


@lru_cache(maxsize=4096)
def is_telemetry(topic: str) -> bool:
    """Whether a topic changes with each measure, so that its sending is paced."""
    return find(topic)[0].pace != "at once"


def read_all(reader: StateReader, now: Instant) -> dict[str, Any]:
    """Members of the snapshot that topics fill, by name."""
    return {row.member: row.read(reader, now) for row in TOPICS if row.read}
