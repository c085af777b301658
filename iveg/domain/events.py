"""Templates of sentences with their values: log lines, conditions, messages to people.

A message to a person away from the page has a priority and a time.  It never names a
place or a person, since it passes through other people's servers
(docs/interfaces/http.md, "Messages").
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.observations import Instant

Language = Literal["es", "en"]
Level = Literal["P1", "P2"]
Priority = Literal["P1", "P2", "P3"]


@dataclass(frozen=True, slots=True)
class Address:
    """Address of apprise, under a name that may be logged.

    Attributes:
        url: Address with its credentials: a secret.
        least: Least priority that is sent to it.
        escalates: Whether it receives only alerts that nobody acknowledges.
    """

    name: str
    url: str = field(repr=False)
    least: Level = "P1"
    escalates: bool = False


@dataclass(frozen=True, slots=True)
class MessagePlan:
    """Addresses of messages; none by default."""

    addresses: tuple[Address, ...] = ()
    escalate_after_s: float = 600.0
    language: Language = "es"


@dataclass(frozen=True, slots=True)
class AlertItem:
    """One occurrence of an alert in a message."""

    priority: Priority
    raised: Instant


@dataclass(frozen=True, slots=True)
class MessageText:
    """A message in one language."""

    title: str
    body: str


Slot = str | float | bool | None
EventKind = Literal["detection", "speed", "command", "link", "alert", "system"]


@dataclass(frozen=True, slots=True)
class LogEvent:
    """One line of the decision and inference log.

    Attributes:
        key: Key of its sentence in ``static/i18n``; ``slots`` fill the placeholders.
        class_: Canonical class that it is about, for filters.
    """

    kind: EventKind
    key: str
    slots: Mapping[str, Slot] = field(default_factory=dict)
    robot_id: str | None = None
    class_: str | None = None
    decision_id: str | None = None


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition that holds now and asks for an alert.

    Attributes:
        key: Key of its sentence.
        subject: Distinguishes conditions with the same key.
    """

    priority: Priority
    key: str
    subject: str
    robot_id: str | None = None
    slots: Mapping[str, Slot] = field(default_factory=dict)

    @classmethod
    def filled(
        cls, priority: Priority, key: str, subject: str, **slots: Slot
    ) -> "Condition":
        """Condition without a robot, from the values of its sentence."""
        return cls(priority, key, subject, None, slots)

    @classmethod
    def of_robot(
        cls, priority: Priority, key: str, robot_id: str, **slots: Slot
    ) -> "Condition":
        """Condition of one robot, which its sentence names."""
        return cls(priority, key, robot_id, robot_id, {"robot": robot_id, **slots})
