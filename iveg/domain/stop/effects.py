"""Events of a STOP machine, and the effects that it asks for."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.stop.attempt import Attempt
from iveg.domain.stop.commands import PLAIN, FollowedCommand, Kind, Press, State, Times
from iveg.domain.stop.wanted import NEW_HOLD, Kept
from iveg.domain.transports import Transport, TransportId

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
"""Kinds of events; also names of their log sentences."""
_ORDERS: Mapping[Key, Kind] = {"releasing": "release", "resuming": "resume"}


@dataclass(frozen=True, slots=True)
class Event:
    """An event, with the arguments of its step.

    Attributes:
        new_id: Names the command that begins, and its hold unless one is ``kept``.
        by: Who wants it.
        press: What the page says of a press.
        kept: The hold that a STOP holds on to.
        attempt: The release or resume that begins.
    """

    key: Key
    at: Instant
    new_id: str = ""
    by: str = "iveg"
    press: Press = PLAIN
    kept: Kept = NEW_HOLD
    attempt: Attempt | None = None

    def begins(self, robot_id: str, transports: Iterable[Transport]) -> FollowedCommand:
        """The command that begins with it; ``off`` on transports that cannot carry it.

        A release or resume is sent once, at once; a STOP as often as it takes.
        """
        kind = _ORDERS.get(self.key, "stop")
        is_stop = kind == "stop"
        plain = not is_stop or self.key in ("requested", "adopted")
        ways = {one.id: "pending" if one.carries(kind) else "off" for one in transports}
        return FollowedCommand(
            self.new_id,
            robot_id,
            kind,
            "REQUESTED" if is_stop else "RELEASING",
            Times.of(self.at, self.press),
            requesters=(self.by,),
            tries=0 if is_stop else 1,
            reason=None if plain else self.key,
            transports=ways,
            drill=self.press.drill,
            held_as=self.kept.hold_id,
        )


@dataclass(frozen=True, slots=True)
class SendStop:
    """Send this hold on this transport, now, for this command."""

    robot_id: str
    hold_id: str
    transport: TransportId
    command_id: str


@dataclass(frozen=True, slots=True)
class SendOnce:
    """Send a release or a resume, once on each transport.

    Attributes:
        ours: Those of its holds that are STOPs of iVeg.
    """

    attempt: Attempt
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

    command_id: str
    state: State
    key: Key
    why: str | None = None
    commands: tuple[FollowedCommand, ...] = ()


@dataclass(frozen=True, slots=True)
class Closed:
    """A command that is no longer followed: its last audit row, and no log line.

    Attributes:
        key: What closed it; its sentence stands at the command that came.
    """

    command: FollowedCommand
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
