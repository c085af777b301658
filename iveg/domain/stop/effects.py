"""Events of a STOP machine, and the effects that it asks for."""

from dataclasses import dataclass
from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.commands import PLAIN, Command, Press, State
from iveg.domain.transports import TransportId

Key = Literal[
    "requested",
    "reasserted",
    "moved",
    "release_unconfirmed",
    "adopted",
    "sent",
    "delivered",
    "standing",
    "unconfirmed",
    "still_moving",
    "stale",
    "releasing",
    "resuming",
    "refused",
    "ready",
    "running",
]
"""What can happen; also names the sentence that tells of it."""


@dataclass(frozen=True, slots=True)
class Event:
    """An event, with what its step needs.

    Attributes:
        new_id: Names the command that begins, and its hold unless one is ``kept``.
        by: Who wants it.
        press: What the page says of a press.
        kept: A hold that the robot has already: it is held on to, none is added.
        doubt: The challenge of a release that may still lift that hold.
        attempt: The release or resume that begins.
    """

    key: Key
    at: Instant
    new_id: str = ""
    by: str = "iveg"
    press: Press = PLAIN
    kept: str | None = None
    doubt: str | None = None
    attempt: Attempt | None = None


@dataclass(frozen=True, slots=True)
class SendStop:
    """Send this hold on this transport, now, for this command."""

    robot_id: str
    hold_id: str
    transport: TransportId
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
    transports: tuple[TransportId, ...]
    ids: tuple[str, ...] = ()
    ours: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SetDesiredState:
    """Publish the retained desired state that a reconnecting robot finds."""

    robot_id: str
    desired: Literal["stopped", "run"]
    ids: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Changed:
    """The state changed: one audit row, one log line.

    Attributes:
        command_id: Whose step it is.
        key: Names the sentence, such as ``standing`` or ``moved``.
        commands: The STOP and the order under way, as they are after it.
    """

    robot_id: str
    command_id: str
    state: State
    key: Key
    why: str | None = None
    commands: tuple[Command, ...] = ()


@dataclass(frozen=True, slots=True)
class Closed:
    """A command that is no longer followed: its last audit row, and no log line.

    Attributes:
        key: What closed it; the sentence of that is told by the command that came.
    """

    robot_id: str
    command: Command
    key: Key


@dataclass(frozen=True, slots=True)
class OffTable:
    """An event without a row in this state: a mistake in the machine.

    Nothing has changed, and the desired state stays.
    """

    robot_id: str
    state: State
    key: Key


Effect = SendStop | SendOnce | SetDesiredState | Changed | Closed | OffTable
