"""When a STOP is sent again, and on which road.

Direct at 0, 250, 500 and 1000 ms, then every half second, after ten seconds every
second, to a standing robot every five.  Through Orion one request at a time, the next
two seconds after the last came back.
"""

from iveg.domain.observations import Instant
from iveg.domain.stop.table import SendRoad

FIWARE_PAUSE_S = 2.0
STANDING_RESEND_S = 5.0
_EARLY_SENDS = (0.25, 0.5, 1.0)


class Sends:
    """The timetable of one robot's STOP."""

    def __init__(self, *, direct: bool) -> None:
        self.has_direct = direct
        self._next_direct = 0.0
        self._next_fiware = 0.0
        self._fiware_busy = False

    def begin(self) -> None:
        """A new episode: what is still on its way belongs to an earlier one."""
        self._fiware_busy = False

    def now(self, at: Instant) -> None:
        """On both roads at once, whatever was due when."""
        self._next_direct = self._next_fiware = at.mono

    def direct_now(self, at: Instant) -> None:
        """On the direct road at the next tick."""
        self._next_direct = at.mono

    def came_back(self, at: Instant) -> None:
        """Orion has answered, or will not."""
        self._fiware_busy = False
        self._next_fiware = at.mono + FIWARE_PAUSE_S

    def due(self, at: Instant, age_s: float, *, standing: bool) -> list[SendRoad]:
        """The roads to send on now; they count as used.

        Args:
            at: This moment.
            age_s: Since the press was accepted (s).
            standing: Whether the robot is known to stand.
        """
        roads: list[SendRoad] = []
        if self.has_direct and at.mono >= self._next_direct:
            self._next_direct = at.mono + _pause(age_s, standing=standing)
            roads.append("direct")
        if self._fiware_is_due(at, standing=standing):
            self._fiware_busy = True
            roads.append("fiware")
        return roads

    def _fiware_is_due(self, at: Instant, *, standing: bool) -> bool:
        """A standing robot is reminded on the direct road alone, where there is one."""
        if self._fiware_busy:
            return False
        if not standing:
            return at.mono >= self._next_fiware
        rest = STANDING_RESEND_S - FIWARE_PAUSE_S
        return not self.has_direct and at.mono >= self._next_fiware + rest


def _pause(age_s: float, *, standing: bool) -> float:
    if standing:
        return STANDING_RESEND_S
    for early in _EARLY_SENDS:
        if age_s < early - 1e-3:
            return early - age_s
    return 0.5 if age_s < 10.0 else 1.0
