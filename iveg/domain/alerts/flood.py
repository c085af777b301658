"""Floods of alerts: more alerts than a person can handle (ISA-18.2).

A flood begins when more than ten alerts come within ten minutes and is over when fewer
than five do (ANSI/ISA-18.2, clause on monitoring and assessment; EEMUA 191).  It is
displayed and hides nothing.  Alerts that ask nothing of anybody are not counted.
"""

from collections import deque
from dataclasses import dataclass

from iveg.domain.observations import Instant

FLOOD_WINDOW_S = 600.0
FLOOD_LIMIT = 10
"""More than this within the window is a flood (ISA-18.2)."""
FLOOD_OVER = 5
"""With fewer than this it is over (ISA-18.2)."""
_MOST_COUNTED = 1000


@dataclass(frozen=True, slots=True)
class FloodState:
    """Number of alerts within the window, at most a thousand.

    Attributes:
        since: When the flood began; None while there is none.
    """

    count: int = 0
    since: Instant | None = None


class FloodGauge:
    """Counts the alerts that sounded, each occurrence once.

    Attributes:
        flood: As it stood when it was last read.
    """

    def __init__(self) -> None:
        self._raised: deque[float] = deque(maxlen=_MOST_COUNTED)
        self.flood = FloodState()

    def count(self, raised: int, now: Instant) -> FloodState:
        """Count the alerts raised now and forget those out of the window."""
        self._raised.extend([now.mono] * raised)
        while self._raised and now.mono - self._raised[0] >= FLOOD_WINDOW_S:
            self._raised.popleft()
        count, since = len(self._raised), self.flood.since
        if since is None and count > FLOOD_LIMIT:
            since = now
        elif count < FLOOD_OVER:
            since = None
        self.flood = FloodState(count, since)
        return self.flood
