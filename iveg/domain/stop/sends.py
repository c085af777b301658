"""Timetable of the repetitions of a STOP on each transport.

A transport that takes any number: at 0, 250, 500 and 1000 ms, then every half second,
after ten seconds every second; to a robot that has it every second, to a standing one
every five.  One that takes one at a time (Orion): the next two seconds after the last
came back, and none to a robot that has it, unless there is no other transport.
"""

from collections.abc import Iterable, Mapping
from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.stop.commands import FollowedCommand
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


class Sends:
    """The timetable of one robot's STOP."""

    def __init__(self, transports: Iterable[Transport]) -> None:
        self._ways = {one.id: one for one in transports if one.can_stop}
        self._is_alone = all(one.one_at_a_time for one in self._ways.values())
        self._sent: dict[TransportId, tuple[float, float]] = {}
        """When a STOP was last sent (monotonic, s), and how old it was then (s)."""
        self._busy: set[TransportId] = set()
        """Those of one at a time with a request under way."""
        self._next: dict[TransportId, float] = {}
        """When those may be asked again (monotonic, s)."""

    def begin(self, at: Instant) -> None:
        """A new episode, on all at once; what is under way is of an earlier one."""
        self._busy.clear()
        self.now(at)

    def now(self, at: Instant) -> None:
        """Make every transport due now."""
        self._sent.clear()
        self._next = dict.fromkeys(self._ways, at.mono)

    def repeat_now(self) -> None:
        """Make those that take any number due at the next check."""
        self._sent.clear()

    def came_back(self, transport: TransportId, at: Instant) -> None:
        """Note that a transport's request has ended."""
        self._busy.discard(transport)
        self._next[transport] = at.mono + FIWARE_PAUSE_S

    def due(self, stop: FollowedCommand, at: Instant) -> list[SendStop]:
        """Sends that are due now; they count as sent."""
        age_s = at.mono - stop.times.requested.mono
        progress = _PROGRESS.get(stop.state, "asked")
        hold_id = stop.hold_id or stop.command_id
        return [
            SendStop(stop.robot_id, hold_id, way.id, stop.command_id)
            for way in self._ways.values()
            if (
                self._is_free(way.id, at, progress)
                if way.one_at_a_time
                else self._is_due(way.id, at, age_s, progress)
            )
        ]

    def _is_due(
        self, way: TransportId, at: Instant, age_s: float, progress: Progress
    ) -> bool:
        """Whether to repeat it on a transport that takes any number."""
        sent_at, age_then = self._sent.get(way, (float("-inf"), 0.0))
        if at.mono - sent_at < _pause(age_then, progress) - _EARLY_S:
            return False
        self._sent[way] = at.mono, age_s
        return True

    def _is_free(self, way: TransportId, at: Instant, progress: Progress) -> bool:
        """Whether to ask a transport that takes one at a time."""
        if way in self._busy or (progress != "asked" and not self._is_alone):
            return False
        rest = STANDING_RESEND_S - FIWARE_PAUSE_S if progress == "standing" else 0.0
        if at.mono < self._next.get(way, 0.0) + rest:
            return False
        self._busy.add(way)
        return True


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
