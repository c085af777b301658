"""How far one who is tracked was ever from one spot, and how sure and fast they were.

Extents are only ever joined: what one sighting of a track knew no other forgets.
"""

from dataclasses import dataclass

from iveg.domain.geometry import Rectangle


@dataclass(frozen=True, slots=True)
class Extent:
    """Of some sightings.

    Attributes:
        around: The box in ``map`` that holds every place of theirs.
        surest: Greatest confidence (0 to 1).
        fastest: Greatest speed (m/s).
    """

    around: Rectangle
    surest: float
    fastest: float = 0.0

    def joined(self, other: "Extent | None") -> "Extent":
        """The extent of both."""
        if other is None:
            return self
        return Extent(
            self.around.joined(other.around),
            max(self.surest, other.surest),
            max(self.fastest, other.fastest),
        )
