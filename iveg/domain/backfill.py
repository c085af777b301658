"""What a robot kept while nobody heard it, and sent afterwards.

It completes the record of a gap and is never acted on: whoever decides does not see it.
"""

from collections import defaultdict, deque
from dataclasses import dataclass, field

from iveg.domain.observations import (
    DetectionFrame,
    Observation,
    Odometry,
    Origin,
    Received,
    SafetyReport,
)

KEPT_S = 600.0
"""What a robot keeps of a gap: the newest of it (s)."""
OLDEST_S = 900.0
"""Kept messages are this old at most when they are sent (s)."""
GAP_S = 1.0
"""A robot that is not heard for so long has a gap (s)."""
PERIOD_S = 0.5
"""Of poses and pictures that are kept (s)."""
MOST_MESSAGES = 20
"""In one batch, and a second."""
MOST_BOXES = 16
"""Of one picture."""
KEPT = Odometry, DetectionFrame, SafetyReport
_MOST_GAPS = 64


@dataclass(frozen=True, slots=True)
class Batch:
    """Kept messages of one robot, in the order in which they were measured.

    Attributes:
        origin: When it was sent, on the robot's own clocks; ``seq`` counts nothing.
        kept: Each with its ``boot``, ``seq`` and ``mono``.
    """

    robot_id: str
    origin: Origin
    kept: tuple[Observation, ...]


@dataclass(slots=True)
class _Heard:
    """When a robot was heard last, and its newest silences (monotonic, s)."""

    at: float = float("-inf")
    silences: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_MOST_GAPS)
    )


class Silences:
    """When iVeg heard nothing of a robot; before the first message too."""

    def __init__(self) -> None:
        self._heard: defaultdict[str, _Heard] = defaultdict(_Heard)

    def hear(self, received: Received) -> None:
        """Take note of a live message; what Orion was asked for is none."""
        one = received.observation
        if received.asked or not isinstance(one, KEPT):
            return
        heard, now = self._heard[one.robot_id], received.at.mono
        if now - heard.at > GAP_S:
            heard.silences.append((heard.at, now))
        heard.at = max(heard.at, now)

    def covers(self, robot_id: str, at: float) -> bool:
        """Whether a moment (monotonic, s) is in a silence that has ended."""
        if robot_id not in self._heard:
            return False
        return any(begin < at < end for begin, end in self._heard[robot_id].silences)
