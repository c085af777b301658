"""Places where something static is known to stand: "known here".

A plan that is off, or a plant that leans out, makes a laser see what no plan explains.
What stays in such a place from first to last, and never moves, slows nobody
(docs/safety.md, "Known here").
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from iveg.domain.obstacle import Obstacle

BESIDE_PLAN_M = 0.5
"""So near what the plan draws a place becomes known by itself."""
LEARNT_RADIUS_M = 0.3
"""The tip of a plant, and the error of two poses."""
REACH_M = 8.0
"""Of a robot: what is farther it is not told of."""
MOST_TOLD = 32


@dataclass(frozen=True, slots=True)
class KnownPlace:
    """A circle in ``map`` (m).

    Attributes:
        most_out_m: How far from what the plan draws a return may be that it explains
            (m); infinite where an operator said so.
    """

    x: float
    y: float
    radius_m: float
    most_out_m: float = math.inf

    def explains(self, seen: Obstacle) -> bool:
        """Whether something was in it from the first return on, and never moved."""
        return (
            not seen.stirred
            and seen.out_m <= self.most_out_m
            and seen.around.farthest_m(self.x, self.y) <= self.radius_m
        )


def is_known(seen: Obstacle, places: Iterable[KnownPlace]) -> bool:
    """Whether one of the places explains something."""
    return any(one.explains(seen) for one in places)
