"""Marks of operators, "not a person here": places where a detector errs.

A mark removes the zones of a track if all its sightings are of the thing: within half a
metre from the first on, slower than a walker, less sure than 0.95.  A person who walks
in, moves or is surely seen is protected as without a mark (docs/safety.md, "Not a
person here").
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

from iveg.domain.observations import Instant
from iveg.domain.tracking.tracker import TrackedPerson

RADIUS_M = 0.5
SURELY_FROM = 0.95
MOVES_FROM_M_S = 0.8
"""Half of a walker's speed: a box that jumps by 0.2 m is noise."""
MOST_THINGS = 32
LONGEST_S = 86_400.0


@dataclass(frozen=True, slots=True)
class Thing:
    """One mark: half a metre around a place, until the end of the day at the latest.

    Attributes:
        x: Middle in ``map`` (m); ``y`` likewise.
        by: Operator who set it, at ``since``; it ends at ``until`` at the latest.
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
        extent = person.extent
        return (
            person.class_ == "person"
            and extent.surest < SURELY_FROM
            and extent.fastest < MOVES_FROM_M_S
            and extent.around.farthest_m(self.x, self.y) <= RADIUS_M
            # Only boxes at known places, by robots of today, are evidence of a thing.
            and not any(
                sighting.recording or sighting.reach_m or sighting.laser
                for sighting in (person.newest, *person.sightings)
            )
        )


@dataclass(slots=True)
class Things:
    """Every mark of operators by id, in the order in which they were set."""

    known: dict[str, Thing] = field(default_factory=dict)

    def explain(self, person: TrackedPerson, now: Instant) -> Thing | None:
        """Mark that explains a track; None: it is somebody."""
        for thing in self.known.values():
            if not thing.is_over(now) and thing.explains(person):
                return thing
        return None

    def end(self, now: Instant) -> Sequence[Thing]:
        """Forget marks whose time is up; returns them."""
        over = [thing for thing in self.known.values() if thing.is_over(now)]
        for thing in over:
            del self.known[thing.thing_id]
        return over
