"""Faint people who are detected again and again (docs/safety.md, "The rule").

A person at 0.50 or more in three of five frames within 1 s and 1 m counts as a possible
person: a setting, off by default, since it costs false slow-downs.
"""

import math
from collections import deque
from collections.abc import Sequence

from iveg.domain.observations import Instant

POSSIBLE_FROM = 0.50
_TIMES, _OF = 3, 5
_WITHIN_S, _WITHIN_M = 1.0, 1.0

_Spot = tuple[float, float]


class PossiblePeople:
    """Places of faint persons in each robot's last frames."""

    def __init__(self) -> None:
        self._detections: dict[str, deque[tuple[float, Sequence[_Spot]]]] = {}

    def seen_again(
        self, spots: Sequence[_Spot], observer: str, at: Instant
    ) -> list[_Spot]:
        """Take one frame; returns its spots (m, ``map``) that were seen often."""
        frames = self._detections.setdefault(observer, deque(maxlen=_OF))
        frames.append((at.mono, spots))
        fresh = [seen for moment, seen in frames if abs(at.mono - moment) <= _WITHIN_S]
        return [
            spot
            for spot in spots
            if sum(_is_near(spot, seen) for seen in fresh) >= _TIMES
        ]


def _is_near(spot: _Spot, seen: Sequence[_Spot]) -> bool:
    return any(math.dist(spot, other) <= _WITHIN_M for other in seen)
