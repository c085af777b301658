"""Things that are taken for a person: an operator's word "not a person here".

A thing is a place, half a metre around it, until the end of the day at the latest.  It
takes the rings of a track whose every sighting, and every sighting that these were ever
taken to continue, is of a thing: inside the circle from the first on, never as fast as
somebody who walks, and never as sure as 0.95.  So who walks in, who moves and who is
surely seen is protected as without it (docs/safety.md, "Not a person here").

The other word, "known here", is about what lasers see and no plan draws: a crate in an
aisle.  It is a mark of the same kind, takes no ring, and ends where anything moves
(docs/safety.md, "Known here").
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.known import KnownPlace
from iveg.domain.observations import Instant
from iveg.domain.tracking.person import Sighting, TrackedPerson

RADIUS_M = 0.5
SURELY_FROM = 0.95
MOVES_FROM_M_S = 0.8
"""Half of a walker's speed: a box that jumps by 0.2 m is noise."""
MOST_THINGS = 32
LONGEST_S = 86_400.0
Kind = Literal["person", "obstacle"]


@dataclass(frozen=True, slots=True)
class Thing:
    """One word of an operator.

    Attributes:
        x: Of its middle in ``map`` (m); ``y`` likewise.
        by: Who said so; ``since`` when, ``until`` when at the latest.
        kind: ``person``: what is taken for one is none; ``obstacle``: what lasers see
            is known.
    """

    thing_id: str
    x: float
    y: float
    by: str
    since: Instant
    until: Instant
    kind: Kind = "person"

    @property
    def place(self) -> KnownPlace:
        """The circle, for lasers."""
        return KnownPlace(self.x, self.y, RADIUS_M)

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
            and extent.around.farthest_m(self.x, self.y) <= RADIUS_M
        )


@dataclass(slots=True)
class Things:
    """Every mark of operators, by id, in the order of their words.

    Attributes:
        known: What is no person.
        obstacles: What is known to lasers.
    """

    known: dict[str, Thing] = field(default_factory=dict)
    obstacles: dict[str, Thing] = field(default_factory=dict)
    _moved: set[str] = field(default_factory=set)

    @property
    def all(self) -> Sequence[Thing]:
        """Both kinds."""
        return [*self.known.values(), *self.obstacles.values()]

    def add(self, thing: Thing) -> None:
        """Take a word of an operator."""
        self._of(thing.kind)[thing.thing_id] = thing

    def pop(self, thing_id: str) -> Thing | None:
        """Take a word back; None: there is none of this id."""
        self._moved.discard(thing_id)
        return self.known.pop(thing_id, self.obstacles.pop(thing_id, None))

    def _of(self, kind: Kind) -> dict[str, Thing]:
        return self.known if kind == "person" else self.obstacles

    def explain(self, person: TrackedPerson, now: Instant) -> Thing | None:
        """The thing that a track is; None: it is somebody."""
        for one in self.known.values():
            if not one.is_over(now) and one.explains(person):
                return one
        return None

    def obstacles_at(self, now: Instant) -> Sequence[Thing]:
        """What is known to lasers now."""
        marks = self.obstacles.values()
        return [
            one
            for one in marks
            if one.thing_id not in self._moved and not one.is_over(now)
        ]

    def moved(self, thing_id: str) -> None:
        """Note that somebody is there, that it moved or went: it is known no more."""
        self._moved.add(thing_id)

    def end(self, now: Instant) -> Sequence[Thing]:
        """Forget those whose time is up, or that moved; returns them."""
        over = [
            one for one in self.all if one.is_over(now) or one.thing_id in self._moved
        ]
        for one in over:
            self.pop(one.thing_id)
        self._moved.clear()
        return over
