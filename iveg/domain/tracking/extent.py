"""How far one who is tracked was ever from one spot, and how sure and fast they were.

Extents are only ever joined: what one sighting of a track knew no other forgets.
"""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Extent:
    """The box in ``map`` that holds every place of some sightings (m).

    Attributes:
        surest: Greatest confidence of theirs (0 to 1).
        fastest: Greatest speed (m/s).
    """

    xmin: float
    xmax: float
    ymin: float
    ymax: float
    surest: float
    fastest: float = 0.0

    def joined(self, other: "Extent | None") -> "Extent":
        """The extent of both."""
        if other is None:
            return self
        return Extent(
            min(self.xmin, other.xmin),
            max(self.xmax, other.xmax),
            min(self.ymin, other.ymin),
            max(self.ymax, other.ymax),
            max(self.surest, other.surest),
            max(self.fastest, other.fastest),
        )

    def farthest_m(self, x: float, y: float) -> float:
        """How far its farthest corner is from a spot (m)."""
        return math.hypot(
            max(x - self.xmin, self.xmax - x), max(y - self.ymin, self.ymax - y)
        )
