"""A person on the map, and the sightings that make and protect one.

::

    seen (<= 1 s) ──> remembered (<= 10 s, zone grows) ──> last seen (<= 600 s, no zone)
      ^________________________|                                 └──> gone

A person who was only glimpsed is gone sooner, and as soon as the place was seen to be
empty.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.geometry import Rectangle
from iveg.domain.limits import LIMITS, grown_radius
from iveg.domain.observations import Instant
from iveg.domain.parameters import Class
from iveg.domain.tracking.looks import Looks

_SMOOTHED_S = 0.4
MISTAKEN_S = 2.5
"""Longest mistake of a detector; most of them last 2 s."""
LASER_LASTS_S = 3.0
"""Memory of somebody whom only a laser saw.  It is a guess what that was, and a zone
that grows for longer slows a robot that passes for nothing."""
Stage = Literal["seen", "remembered", "last_seen", "gone"]


@dataclass(frozen=True, slots=True)
class Sighting:
    """The newest detection of one person by one robot, in ``map``.

    Attributes:
        at: Source moment on our clocks.
        looks: All looks at this person by then; None of a robot, and where one box
            counts that is too faint to be a look.
        reach_m: Where the position is doubtful, x and y are the observer's own, and
            this is how far its camera reaches (m); else 0.
        chain: Number of the chain of sightings whose newest this is.
        recording: The map frame of the recording that saw it; None: a robot of today.
        vx: How its chain goes in ``map`` (m/s); ``vy`` likewise.
        possible: Whether it counts by its looks alone, below the threshold.
        laser: Only the observer's laser saw it: it moves like somebody who walks.
        beyond_m: How much farther its box reaches than a person does (m); the zone is
            as much wider.
    """

    observer: str
    x: float
    y: float
    z: float
    at: Instant
    class_id: str
    confidence: float
    looks: Looks | None = None
    reach_m: float = 0.0
    chain: int = 0
    recording: str | None = None
    vx: float = 0.0
    vy: float = 0.0
    possible: bool = False
    laser: bool = False
    beyond_m: float = 0.0

    @property
    def kind(self) -> tuple[bool, bool]:
        """Evidence that it counts by: looks, laser; one for a chain."""
        return self.possible, self.laser

    @property
    def lasts_s(self) -> float:
        """Age up to which it has a zone (s)."""
        return LASER_LASTS_S if self.laser else LIMITS.zone_lasts_s

    def age_s(self, now: Instant) -> float:
        """Seconds since the sighting."""
        # Asked thousands of times a second: ``max`` takes three times as long.
        age_s = now.mono - self.at.mono
        return age_s if age_s > 0.0 else 0.0

    def in_chain(self, chain: int, before: "Sighting | None" = None) -> "Sighting":
        """This sighting as the newest of a chain, after the one ``before``."""
        vx, vy = (0.0, 0.0) if before is None else self._going_on(before)
        return replace(self, chain=chain, vx=vx, vy=vy)

    def _going_on(self, before: "Sighting") -> tuple[float, float]:
        """The velocity of the chain (m/s), smoothed over 0.4 s, of a walker at most."""
        after_s = self.at.mono - before.at.mono
        if not 0.0 < after_s <= LIMITS.seen_s or self.reach_m or before.reach_m:
            return 0.0, 0.0
        gain = after_s / (_SMOOTHED_S + after_s)
        vx = before.vx + gain * ((self.x - before.x) / after_s - before.vx)
        vy = before.vy + gain * ((self.y - before.y) / after_s - before.vy)
        least = min(1.0, LIMITS.walking_m_s / max(math.hypot(vx, vy), 1e-9))
        return vx * least, vy * least


@dataclass(frozen=True, slots=True)
class Extent:
    """Places, confidence and speed of all sightings that a track ever had.

    Attributes:
        around: The box in ``map`` that holds every place of theirs.
        surest: Greatest confidence (0 to 1).
        fastest: Greatest speed (m/s).
    """

    around: Rectangle
    surest: float
    fastest: float

    @classmethod
    def of(cls, sighting: Sighting) -> "Extent":
        """The extent of one sighting."""
        x, y = sighting.x, sighting.y
        speed = math.hypot(sighting.vx, sighting.vy)
        return cls(Rectangle(x, y, x, y), sighting.confidence, speed)

    def joined(self, other: "Extent") -> "Extent":
        """The extent of both."""
        return Extent(
            self.around.joined(other.around),
            max(self.surest, other.surest),
            max(self.fastest, other.fastest),
        )


@dataclass(frozen=True, slots=True)
class TrackedPerson:
    """A person, or a robot that does not belong to the fleet, with all sightings.

    Attributes:
        person_id: Of the track: the same person as long as iVeg can tell.
        sightings: The newest of each chain of sightings; each has a zone of its own.
        extent: Of every sighting since the first.
    """

    person_id: str
    class_: Class
    decision_id: str
    first_seen: Instant
    newest: Sighting
    sightings: tuple[Sighting, ...]
    extent: Extent

    def age_s(self, now: Instant) -> float:
        """Seconds since the newest sighting by any robot."""
        return self.newest.age_s(now)

    @property
    def is_well_known(self) -> bool:
        """Whether they were in sight for longer than a detector's mistake."""
        return self.newest.at.mono - self.first_seen.mono >= MISTAKEN_S

    @property
    def middle(self) -> tuple[float, float]:
        """Middle of the places where they have been, in ``map`` (m)."""
        return self.extent.around.middle

    def stage(self, now: Instant) -> Stage:
        """The stage of life of the newest sighting."""
        age = self.age_s(now)
        if age <= LIMITS.seen_s:
            return "seen"
        if not self.sightings and not self.is_well_known:
            return "gone"
        if age <= self.newest.lasts_s or any(
            one.age_s(now) <= one.lasts_s for one in self.sightings
        ):
            return "remembered"
        lasts_s = LIMITS.last_seen_s if self.is_well_known else LIMITS.glimpsed_s
        return "last_seen" if age <= lasts_s else "gone"

    def observers(self, now: Instant) -> list[str]:
        """Robots that see this person now, in the order in which they began to."""
        return list(
            dict.fromkeys(
                one.observer
                for one in self.sightings
                if one.age_s(now) <= LIMITS.seen_s
            )
        )

    def zone_radii(
        self, rule: DetectionRule, now: Instant
    ) -> Iterable[tuple[Sighting, float]]:
        """Every zone that protects this person, with its radius now (m)."""
        fresh_m = rule.radius_m.of(self.class_)
        for sighting in self.sightings:
            age = sighting.age_s(now)
            if age <= sighting.lasts_s:
                radius_m = grown_radius(fresh_m, age) + sighting.beyond_m
                yield sighting, max(radius_m, sighting.reach_m)


RADIUS_M = 0.5
SURELY_FROM = 0.95
MOVES_FROM_M_S = 0.8
"""Half of a walker's speed: a box that jumps by 0.2 m is noise."""
MOST_THINGS = 32
LONGEST_S = 86_400.0


@dataclass(frozen=True, slots=True)
class Thing:
    """One word of an operator: "not a person here".

    A thing is a place, half a metre around it, until the end of the day at the latest.
    It takes the zones of a track if all sightings that it ever had are of the thing:
    within half a metre from the first on, slower than a walker, less sure than 0.95.  A
    person who walks in, moves or is surely seen is protected as without it
    (docs/safety.md, "Not a person here").

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
        extent = person.extent
        return (
            person.class_ == "person"
            and extent.surest < SURELY_FROM
            and extent.fastest < MOVES_FROM_M_S
            and extent.around.farthest_m(self.x, self.y) <= RADIUS_M
            and not any(
                one.recording or one.reach_m or one.laser
                for one in (person.newest, *person.sightings)
            )
        )


@dataclass(slots=True)
class Things:
    """Every mark of operators, by id, in the order of their words."""

    known: dict[str, Thing] = field(default_factory=dict)

    def explain(self, person: TrackedPerson, now: Instant) -> Thing | None:
        """The thing that a track is; None: it is somebody."""
        for one in self.known.values():
            if not one.is_over(now) and one.explains(person):
                return one
        return None

    def end(self, now: Instant) -> Sequence[Thing]:
        """Forget those whose time is up; returns them."""
        over = [one for one in self.known.values() if one.is_over(now)]
        for one in over:
            del self.known[one.thing_id]
        return over
