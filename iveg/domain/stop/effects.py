"""What the STOP machine asks the world to do."""

from dataclasses import dataclass
from typing import Literal

from iveg.domain.stop.commands import Command
from iveg.domain.stop.table import SendRoad, State


@dataclass(frozen=True, slots=True)
class SendStop:
    """Send this hold on this road, now."""

    robot_id: str
    hold_id: str
    road: SendRoad


@dataclass(frozen=True, slots=True)
class SendOnce:
    """Send a release (with ids) or a resume (without), once, through Orion alone."""

    robot_id: str
    command_id: str
    kind: Literal["release", "resume"]
    challenge: str
    ids: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SetLevel:
    """Publish the retained level that a reconnecting robot finds."""

    robot_id: str
    desired: Literal["stopped", "run"]
    ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Changed:
    """The state changed: one audit row, one log line.

    Attributes:
        key: Names the sentence, such as ``standing`` or ``moved``.
    """

    robot_id: str
    command_id: str
    state: State
    key: str
    why: str | None = None


@dataclass(frozen=True, slots=True)
class Closed:
    """A command that is followed no more: its last audit row, and no log line.

    Attributes:
        key: What closed it; the sentence of that is told by the command that came.
    """

    robot_id: str
    command: Command
    key: str


Effect = SendStop | SendOnce | SetLevel | Changed | Closed
