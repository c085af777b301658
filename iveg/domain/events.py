"""Sentences to come: log lines, conditions of alerts, and messages to people elsewhere.

Each is the name of a template and what fills its holes.  A message outside the page
says how grave it is and when, never where or about whom: it passes through other
people's servers (docs/interfaces/http.md, "Messages").
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
    """An address of apprise, under a name that may be logged.

    Attributes:
        url: Mostly a secret.
        least: The least priority that is sent.
        escalates: Reached only where nobody acknowledges.
    """

    name: str
    url: str = field(repr=False)
    least: Level = "P1"
    escalates: bool = False


@dataclass(frozen=True, slots=True)
class MessagePlan:
    """All addresses outside the page; none at first."""

    addresses: tuple[Address, ...] = ()
    escalate_after_s: float = 600.0
    language: Language = "es"


@dataclass(frozen=True, slots=True)
class AlertItem:
    """One occurrence of an alert, in a message."""

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
        key: Names the sentence in ``static/i18n``; ``slots`` fill its holes.
        class_: The canonical class that the line is about, for filters.
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
        key: Names the sentence; ``subject`` distinguishes two of a kind.
    """

    priority: Priority
    key: str
    subject: str
    robot_id: str | None = None
    slots: Mapping[str, Slot] = field(default_factory=dict)

    @classmethod
    def of_robot(
        cls, priority: Priority, key: str, robot_id: str, **slots: Slot
    ) -> "Condition":
        """A condition of one robot, whom its sentence names."""
        return cls(priority, key, robot_id, robot_id, {"robot": robot_id, **slots})
