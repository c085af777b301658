"""Things that are taken for a person: an operator's word "not a person here".

A thing is a place, half a metre around it, until the end of the day at the latest.  It
takes the rings of a track whose every sighting, and every sighting that these were ever
taken to continue, is of a thing: inside the circle from the first on, never as fast as
somebody who walks, and never as sure as 0.95.  So who walks in, who moves and who is
surely seen is protected as without it (docs/safety.md, "Not a person here").
"""

from collections.abc import Iterable
from dataclasses import dataclass, field

from iveg.domain.observations import Instant
from iveg.domain.tracking.person import Sighting, TrackedPerson

RADIUS_M = 0.5
SURELY_FROM = 0.95
MOVES_FROM_M_S = 0.8
"""Half of a walker's speed: a box that jumps by 0.2 m is noise."""
MOST_THINGS = 32
LONGEST_S = 86_400.0


@dataclass(frozen=True, slots=True)
class Thing:
    """One word of an operator.

    Attributes:
        x: Of its middle in ``map`` (m); ``y`` likewise.
        by: Who said so; ``since`` when, ``until`` when at the latest.
    """

    thing_id: str
    x: float
    y: float
    by: str
    since: Instant
    until: Instant

    def is_over(self, now: Instant) -> bool:
        """Whether its time is up, by either clock."""
        return now.mono >= self.until.mono or now.wall >= self.until.wall

    def explains(self, person: TrackedPerson) -> bool:
        """Whether a track is nothing but this thing."""
        seen = (person.newest, *person.sightings)
        return person.class_ == "person" and all(map(self._explains, seen))

    def _explains(self, sighting: Sighting) -> bool:
        extent = sighting.extent
        return (
            extent is not None
            and sighting.recording is None
            and not sighting.reach_m
            and not sighting.laser
            and extent.surest < SURELY_FROM
            and extent.fastest < MOVES_FROM_M_S
            and extent.farthest_m(self.x, self.y) <= RADIUS_M
        )


@dataclass(slots=True)
class Things:
    """Every thing that operators have marked, by id, in the order of their words."""

    known: dict[str, Thing] = field(default_factory=dict)

    def explain(self, person: TrackedPerson, now: Instant) -> Thing | None:
        """The thing that a track is; None: it is somebody."""
        for one in self.known.values():
            if not one.is_over(now) and one.explains(person):
                return one
        return None

    def end(self, now: Instant) -> Iterable[Thing]:
        """Forget those whose time is up; returns them."""
        over = [one for one in self.known.values() if one.is_over(now)]
        for one in over:
            del self.known[one.thing_id]
        return over
