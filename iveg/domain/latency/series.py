"""One hop's durations over time: ten-second slices become minutes become hours.

::

    added ──> buffer ──10 s──> slice ──60 s──> minute ──60 min──> hour
              at most 512      7 kept          15 kept            24 kept

Each step merges finished sketches, so that a window of a day is read from at most 24
hours, 60 minutes and 6 slices, and never from its messages.
"""

from collections import deque
from typing import Final

from iveg.domain.latency.segments import Window
from iveg.domain.latency.sketch import Sketch, merged, sketch_of

SLICE_S: Final = 10.0
SLICES_A_MINUTE: Final = 6
SLICES_AN_HOUR: Final = 360
_BUFFER: Final = 512


class Series:
    """Latency of one hop, for one kind of data of one robot."""

    __slots__ = (
        "_buffer",
        "_folded",
        "_hour",
        "_hours",
        "_minute",
        "_minutes",
        "_slices",
        "count",
        "newest",
        "newest_at",
        "total",
    )

    def __init__(self) -> None:
        self._buffer: list[float] = []
        self._folded: list[Sketch] = []
        self._slices: deque[Sketch] = deque(maxlen=SLICES_A_MINUTE)
        self._minute: list[Sketch] = []
        self._minutes: deque[Sketch] = deque(maxlen=15)
        self._hour: list[Sketch] = []
        self._hours: deque[Sketch] = deque(maxlen=24)
        self.count = 0
        """How many there were since the start; ``total`` their sum (s)."""
        self.total = 0.0
        self.newest = 0.0
        """The last duration (s); ``newest_at`` when it was measured (monotonic, s)."""
        self.newest_at = float("-inf")

    def add(self, duration_s: float, now: float) -> None:
        """One more message passed (``now`` monotonic, s)."""
        self.newest, self.newest_at = duration_s, now
        self.count += 1
        self.total += duration_s
        self._buffer.append(duration_s)
        if len(self._buffer) >= _BUFFER:
            self._fold()

    def end_slice(self, count: int) -> Sketch | None:
        """A slice is over, the ``count``-th of all (from 1).

        Returns:
            The minute that is over with it; None: none is.
        """
        self._fold()
        ended = merged(self._folded)
        self._folded = []
        self._slices.append(ended)
        self._minute.append(ended)
        if count % SLICES_A_MINUTE:
            return None
        minute = merged(self._minute)
        self._minute = []
        self._minutes.append(minute)
        self._hour.append(minute)
        if count % SLICES_AN_HOUR == 0:
            self._hours.append(merged(self._hour))
            self._hour = []
        return minute

    def remember(self, hour: Sketch) -> None:
        """An hour of an earlier run, oldest first; it is of the day alone."""
        self._hours.append(hour)

    def parts(self, window: Window) -> list[Sketch]:
        """Finished sketches that together are this window, to be merged."""
        self._fold()
        now = list(self._folded)
        if window == "1min":
            return [*self._slices, *now]
        if window == "15min":
            return [*self._minutes, *self._minute, *now]
        return [*self._hours, *self._hour, *self._minute, *now]

    def _fold(self) -> None:
        if self._buffer:
            self._folded.append(sketch_of(self._buffer))
            self._buffer = []
