"""Timetable of the repetitions of a STOP on each transport.

A transport that takes any number: at 0, 250, 500 and 1000 ms, then every half second,
after ten seconds every second; to a robot that has it every second, to a standing one
every five.  One that takes one at a time (Orion): the next two seconds after the last
came back, and none to a robot that has it, unless there is no other transport.
"""

from collections.abc import Iterable, Mapping
from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.stop.commands import Command
from iveg.domain.stop.effects import SendStop
from iveg.domain.transports import Transport, TransportId

FIWARE_PAUSE_S = 2.0
DELIVERED_RESEND_S = 1.0
STANDING_RESEND_S = 5.0
_EARLY_SENDS = (0.25, 0.5, 1.0)
_EARLY_S = 1e-3
"""Clocks that tick in fractions meet a planned moment only nearly."""

Progress = Literal["asked", "delivered", "standing"]
"""Progress known from the robot: none, STOP received, standing still."""
_PROGRESS: Mapping[str, Progress] = {
    "DELIVERED": "delivered",
    "STILL_MOVING": "delivered",
    "STANDING": "standing",
}


class Repeated:
    """One transport that takes a STOP whenever it is due."""

    def __init__(self) -> None:
        self._sent_at = float("-inf")
        self._age_then = 0.0

    def now(self, _: Instant) -> None:
        """Make the next check send."""
        self._sent_at = float("-inf")

    def begin(self) -> None:
        """A new episode."""

    def came_back(self, at: Instant) -> None:
        """Without effect: the result does not change the timetable."""

    def is_due(self, at: Instant, age_s: float, progress: Progress) -> bool:
        """Whether to send now; that counts as sent."""
        pause = _pause(self._age_then, progress)
        if at.mono - self._sent_at < pause - _EARLY_S:
            return False
        self._sent_at, self._age_then = at.mono, age_s
        return True


class OneAtATime:
    """One transport with at most one request under way.

    Args:
        alone: There is no other way to the robot.
    """

    def __init__(self, *, alone: bool) -> None:
        self._alone = alone
        self._next = 0.0
        self._busy = False

    def now(self, at: Instant) -> None:
        """Send as soon as no request is under way."""
        self._next = at.mono

    def begin(self) -> None:
        """A new episode: what is still on its way belongs to an earlier one."""
        self._busy = False

    def came_back(self, at: Instant) -> None:
        """Note that the request has ended."""
        self._busy = False
        self._next = at.mono + FIWARE_PAUSE_S

    def is_due(self, at: Instant, _: float, progress: Progress) -> bool:
        """Whether to send now; that counts as sent."""
        if self._busy or (progress != "asked" and not self._alone):
            return False
        rest = STANDING_RESEND_S - FIWARE_PAUSE_S if progress == "standing" else 0.0
        self._busy = at.mono >= self._next + rest
        return self._busy


class Sends:
    """The timetable of one robot's STOP."""

    def __init__(self, transports: Iterable[Transport]) -> None:
        carriers = [one for one in transports if one.can_stop]
        alone = all(one.one_at_a_time for one in carriers)
        self._ways: dict[TransportId, Repeated | OneAtATime] = {
            one.id: OneAtATime(alone=alone) if one.one_at_a_time else Repeated()
            for one in carriers
        }

    def begin(self, at: Instant) -> None:
        """A new episode: on every transport at once."""
        for way in self._ways.values():
            way.begin()
        self.now(at)

    def now(self, at: Instant) -> None:
        """Make every transport due now."""
        for way in self._ways.values():
            way.now(at)

    def repeat_now(self, at: Instant) -> None:
        """Make those that take any number due at the next check."""
        for way in self._ways.values():
            if isinstance(way, Repeated):
                way.now(at)

    def came_back(self, transport: TransportId, at: Instant) -> None:
        """Note that a transport's request has ended."""
        if transport in self._ways:
            self._ways[transport].came_back(at)

    def due(self, stop: Command, at: Instant) -> list[SendStop]:
        """Sends that are due now; they count as sent."""
        age_s = at.mono - stop.times.requested.mono
        progress = _PROGRESS.get(stop.state, "asked")
        hold_id = stop.hold_id or stop.command_id
        return [
            SendStop(stop.robot_id, hold_id, name, stop.command_id)
            for name, way in self._ways.items()
            if way.is_due(at, age_s, progress)
        ]


def _pause(age_s: float, progress: Progress) -> float:
    """Pause after a send at this age (s)."""
    if progress == "standing":
        return STANDING_RESEND_S
    if progress == "delivered":
        return DELIVERED_RESEND_S
    for early in _EARLY_SENDS:
        if age_s < early - _EARLY_S:
            return early - age_s
    return 0.5 if age_s < 10.0 else 1.0
