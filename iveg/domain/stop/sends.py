"""When a STOP is sent again, and on which transport.

Direct at 0, 250, 500 and 1000 ms, then every half second, after ten seconds every
second; to a robot that has it every second, to a standing one every five.  Through
Orion one request at a time, the next two seconds after the last came back, and none to
a robot that has it, unless there is no other transport.
"""

from typing import Literal

from iveg.domain.observations import Instant
from iveg.domain.stop.table import Transport

FIWARE_PAUSE_S = 2.0
DELIVERED_RESEND_S = 1.0
STANDING_RESEND_S = 5.0
_EARLY_SENDS = (0.25, 0.5, 1.0)
_EARLY_S = 1e-3
"""Clocks that tick in fractions meet a planned moment only nearly."""

Progress = Literal["asked", "delivered", "standing"]
"""What the robot has said so far: nothing, that it has it, that it stands."""


class Sends:
    """The timetable of one robot's STOP."""

    def __init__(self, *, direct: bool) -> None:
        self.has_direct = direct
        self._sent_direct = float("-inf")
        self._age_then = 0.0
        self._next_fiware = 0.0
        self._fiware_busy = False

    def begin(self) -> None:
        """A new episode: what is still on its way belongs to an earlier one."""
        self._fiware_busy = False

    def now(self, at: Instant) -> None:
        """On both transports at once, whatever was due when."""
        self.direct_now()
        self._next_fiware = at.mono

    def direct_now(self) -> None:
        """On the direct transport at the next tick."""
        self._sent_direct = float("-inf")

    def came_back(self, at: Instant) -> None:
        """Orion has answered, or will not."""
        self._fiware_busy = False
        self._next_fiware = at.mono + FIWARE_PAUSE_S

    def due(self, at: Instant, age_s: float, progress: Progress) -> list[Transport]:
        """The transports to send on now; they count as used.

        Args:
            at: This moment.
            age_s: Since the press was accepted (s).
            progress: What the robot has said so far.
        """
        due: list[Transport] = []
        if self.has_direct and self._direct_is_due(at, progress):
            self._sent_direct, self._age_then = at.mono, age_s
            due.append("direct")
        if self._fiware_is_due(at, progress):
            self._fiware_busy = True
            due.append("fiware")
        return due

    def _direct_is_due(self, at: Instant, progress: Progress) -> bool:
        waited = at.mono - self._sent_direct
        return waited >= _pause(self._age_then, progress) - _EARLY_S

    def _fiware_is_due(self, at: Instant, progress: Progress) -> bool:
        if self._fiware_busy or (progress != "asked" and self.has_direct):
            return False
        rest = STANDING_RESEND_S - FIWARE_PAUSE_S if progress == "standing" else 0.0
        return at.mono >= self._next_fiware + rest


def _pause(age_s: float, progress: Progress) -> float:
    """How long after a send at this age the next is due (s)."""
    if progress == "standing":
        return STANDING_RESEND_S
    if progress == "delivered":
        return DELIVERED_RESEND_S
    for early in _EARLY_SENDS:
        if age_s < early - _EARLY_S:
            return early - age_s
    return 0.5 if age_s < 10.0 else 1.0
