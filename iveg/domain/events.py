"""Log lines and conditions of alerts: a template's name and what fills its holes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.messages import Priority

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
