"""Credit: how much telemetry may be on its way to one browser.

Buffers of the kernel, of the server and of the browser are queues without a size, and
telemetry that waits in them shows the past.  So the page says which frame it has
painted, and no more than a window of unpainted frames is ever sent: further changes
wait in slots, where the newest wins.
"""

from collections import deque
from typing import Final, NamedTuple

from iveg.web.presses import read_number

SUBPROTOCOL: Final = "iveg.2"
"""A browser asks for paced telemetry by this WebSocket subprotocol."""

FRAMES: Final = 8
"""Spread over the round trip: 300 ms away a page still gets 26 frames a second."""
BYTES: Final = 24_576
"""Of what is heavy in them (scans, detections, people): 0.2 s of a line of 1 Mbit/s."""
GAP_S: Final = 0.002
"""Frames nearer to each other would cost more than the freshness that they bring."""
ROBOT_GAP_S: Final = 0.0002
"""The same for each robot of the fleet, where that is more: 4 ms with twenty."""
SLOW_FRAME_S: Final = 0.03
"""A page that draws for longer than this twice is slow."""

_LEARNS: Final = 0.5


class _Sent(NamedTuple):
    number: int
    heavy: int
    at: float


class CreditWindow:
    """The frames that one page has not painted yet; times are monotonic (s).

    Attributes:
        gap_s: Least time between two frames.
    """

    def __init__(self) -> None:
        self.gap_s = GAP_S
        self._sent: deque[_Sent] = deque()
        self._number = 0
        self._sent_at = float("-inf")
        self._round_trip_s = 0.0
        self._line_s: float | None = None

    @property
    def next_number(self) -> int:
        """Number of the next frame, from 1."""
        return self._number + 1

    @property
    def opens_at(self) -> float:
        """When the next frame may go; ``inf``: not before one is painted."""
        if len(self._sent) >= FRAMES:
            return float("inf")
        return self._sent_at + (self._apart_s if self._sent else self.gap_s)

    @property
    def _apart_s(self) -> float:
        """Between frames of which none is painted (s).

        Many on a long line, so that it is used; two while a page draws that takes
        longer than screens do: more would only keep it from drawing.
        """
        if self._line_s is None:
            return max(self.gap_s, self._round_trip_s / FRAMES)
        half_s = (self._round_trip_s - self._line_s) / 2
        draws_s = half_s if half_s > SLOW_FRAME_S else 0.0
        return max(self.gap_s, self._line_s / FRAMES, draws_s)

    @property
    def room(self) -> int:
        """Number of heavy bytes that may go with it."""
        return BYTES - sum(one.heavy for one in self._sent)

    def sent(self, heavy: int, now: float) -> None:
        """One more frame is on its way, ``heavy`` bytes of it heavy."""
        self._number += 1
        self._sent_at = now
        self._sent.append(_Sent(self._number, heavy, now))

    def painted(self, number: object, now: float, within: object = None) -> bool:
        """The page has painted this frame and all before; whether that was news.

        ``within``, in its own words, is half its shortest round trip (s).
        """
        if type(number) is not int or number > self._number:
            return False
        if not self._sent or number < self._sent[0].number:
            return False
        # The oldest of them says how long the credit has been out.
        away_s = now - self._sent[0].at
        self._round_trip_s += _LEARNS * (away_s - self._round_trip_s)
        while self._sent and self._sent[0].number <= number:
            self._sent.popleft()
        half_s = _bounded(within, self._round_trip_s / 2)
        self._line_s = None if half_s is None else 2 * half_s
        return True


def _bounded(value: object, most: float) -> float | None:
    """A time that a page has sent; None where it is none, or longer than possible."""
    number = read_number(value)
    return number if number is not None and 0.0 <= number <= most else None
