"""One press is one STOP, however often and on whatever transport it comes.

A page sends a press over HTTP and over its WebSocket and repeats it until it is taken.
Presses are remembered for a while; one that comes back later counts as a new press,
because a STOP too many is better than one too few.
"""

from collections import OrderedDict

from iveg.domain.observations import Instant
from iveg.domain.stop import Press

REMEMBERED_S = 60.0
_MOST = 4096

_Key = tuple[str, str, str]


class Presses:
    """The command of each press, for a while."""

    def __init__(self) -> None:
        self._known: OrderedDict[_Key, tuple[float, str]] = OrderedDict()

    def find(self, by: str, press: Press, robot_id: str, at: Instant) -> str | None:
        """The command that this press has begun; None for a new press."""
        if press.press_id is None:
            return None
        since, command_id = self._known.get(
            (by, press.press_id, robot_id), (float("-inf"), "")
        )
        return command_id if at.mono - since <= REMEMBERED_S else None

    def note(
        self, by: str, press: Press, robot_id: str, command_id: str, at: Instant
    ) -> None:
        """Remember the command of this press."""
        if press.press_id is None:
            return
        self._known[by, press.press_id, robot_id] = at.mono, command_id
        while len(self._known) > _MOST:
            self._known.popitem(last=False)
