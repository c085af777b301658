"""What the STOP machine asks the world to do."""

from dataclasses import dataclass
from typing import Literal

from iveg.domain.stop.commands import Command
from iveg.domain.stop.table import State, Transport


@dataclass(frozen=True, slots=True)
class SendStop:
    """Send this hold on this transport, now, for this command."""

    robot_id: str
    hold_id: str
    road: Transport
    command_id: str


@dataclass(frozen=True, slots=True)
class SendOnce:
    """Send a release (with ids) or a resume (without), once on each transport.

    Attributes:
        command_id: Of the order; the attempt that its answers name.
        ours: Those of ``ids`` that are STOPs of iVeg.
    """

    robot_id: str
    command_id: str
    kind: Literal["release", "resume"]
    challenge: str
    transports: tuple[Transport, ...]
    ids: tuple[str, ...] = ()
    ours: tuple[str, ...] = ()


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
