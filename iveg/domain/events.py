"""Log lines as values: a template's name and what fills its holes."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

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
