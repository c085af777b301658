"""A person on the map, and the sightings that make and protect one.

::

    seen (<= 1 s) ──> remembered (<= 10 s, ring grows) ──> last seen (<= 600 s, no ring)
      ^________________________|                                 └──> gone

Who was only glimpsed is gone sooner, and as soon as the place was seen to be empty.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Literal

from iveg.domain.detection_rule import Class, DetectionRule
from iveg.domain.geometry import Rectangle
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.tracking.extent import Extent
from iveg.domain.tracking.looks import Looks

_SMOOTHED_S = 0.4
MISTAKEN_S = 2.5
"""What is seen for longer is no mistake of a detector, of which most last 2 s."""
LASER_LASTS_S = 3.0
"""So long somebody whom only a laser saw is remembered: who or what it was is a guess,
and beside a robot that passes, a ring that grows for longer slows it for nothing."""
_MOST_PLACES = 16
Stage = Literal["seen", "remembered", "last_seen", "gone"]


@dataclass(frozen=True, slots=True)
class Followed:
    """Where a laser has had somebody in sight, since its camera lost them.

    Attributes:
        x: Their middle in ``map`` (m); ``y`` likewise.
        at: When the laser saw them there last (monotonic, s).
    """

    x: float
    y: float
    at: float


@dataclass(frozen=True, slots=True)
class Sighting:
    """The newest detection of one person by one robot, in ``map``.

    Attributes:
        at: Source moment on our clocks.
        looks: All looks at this person by then; None of a robot, and where one box
            counts that is too faint to be a look.
        reach_m: Where the position is doubtful, x and y are the observer's own, and
            this is how far its camera reaches (m); else 0.
        chain: Number of the chain of sightings whose newest this is; negative: of the
            second place of a box that may be in two (``iveg.domain.frames``).
        recording: The map frame of the recording that saw it; None: a robot of today.
        vx: How its chain goes in ``map`` (m/s); ``vy`` likewise.
        possible: Whether it counts by its looks alone, below the threshold.
        laser: Only the observer's laser saw it: it moves like somebody who walks.
        extent: Of its chain, and of all that this was ever taken to continue; None
            before it is part of a chain.
        known_until: Of a laser: who is seen may be somebody whom a camera saw, and who
            is remembered so long (monotonic, s).
        followed: Where they went from there by the observer's laser, which moves the
            ring and nothing else; None: nobody knows.
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
    extent: Extent | None = None
    known_until: float = -math.inf
    followed: Followed | None = None

    @property
    def place(self) -> tuple[float, float]:
        """Middle of its ring, in ``map`` (m)."""
        followed = self.followed
        return (self.x, self.y) if followed is None else (followed.x, followed.y)

    def ring_age_s(self, now: Instant) -> float:
        """For how long its ring may have grown (s).

        Whoever is followed is not foreseen, so theirs is never younger than of somebody
        who was in sight a second ago.
        """
        age_s, followed = self.age_s(now), self.followed
        if followed is None:
            return age_s
        return min(age_s, LIMITS.seen_s + max(0.0, now.mono - followed.at))

    @property
    def lasts_s(self) -> float:
        """Age up to which it has a ring (s)."""
        if not self.laser:
            return LIMITS.ring_lasts_s
        return max(LASER_LASTS_S, self.known_until - self.at.mono)

    def age_s(self, now: Instant) -> float:
        """Seconds since the sighting."""
        # Asked thousands of times a second: ``max`` takes three times as long.
        age_s = now.mono - self.at.mono
        return age_s if age_s > 0.0 else 0.0

    def in_chain(self, chain: int, before: "Sighting | None" = None) -> "Sighting":
        """The same sighting as the newest of a chain, after the one ``before``."""
        vx, vy = (0.0, 0.0) if before is None else self._going_on(before)
        x, y = self.x, self.y
        extent = Extent(Rectangle(x, y, x, y), self.confidence, math.hypot(vx, vy))
        # Made for each box of each picture: ``replace`` takes three times as long.
        return Sighting(
            self.observer,
            self.x,
            self.y,
            self.z,
            self.at,
            self.class_id,
            self.confidence,
            self.looks,
            self.reach_m,
            chain,
            self.recording,
            vx,
            vy,
            self.possible,
            self.laser,
            extent if before is None else extent.joined(before.extent),
            self.known_until if before is None else before.known_until,
        )

    def in_track(self, person: "TrackedPerson") -> "Sighting":
        """The same, of a chain that begins in a track that is known."""
        extent = self.extent
        if extent is not None:
            for earlier in (person.newest, *person.sightings):
                extent = extent.joined(earlier.extent)
        return replace(self, extent=extent)

    def remembered(self, until: float) -> "Sighting":
        """The same, which is remembered at least so long (monotonic, s)."""
        return replace(self, known_until=max(until, self.known_until))

    def followed_to(self, place: Followed) -> "Sighting":
        """The same of somebody whom a laser has in sight."""
        return replace(self, followed=place)

    def _going_on(self, before: "Sighting") -> tuple[float, float]:
        """The velocity of the chain (m/s), smoothed over 0.4 s, of a walker at most."""
        after_s = self.at.mono - before.at.mono
        if not 0.0 < after_s <= LIMITS.seen_s or self.reach_m or before.reach_m:
            return 0.0, 0.0
        gain = after_s / (_SMOOTHED_S + after_s)
        vx = before.vx + gain * ((self.x - before.x) / after_s - before.vx)
        vy = before.vy + gain * ((self.y - before.y) / after_s - before.vy)
        return of_a_walker(vx, vy)


def of_a_walker(vx: float, vy: float) -> tuple[float, float]:
    """A velocity, no faster than anybody walks (m/s)."""
    least = min(1.0, LIMITS.walking_m_s / max(math.hypot(vx, vy), 1e-9))
    return vx * least, vy * least


@dataclass(frozen=True, slots=True)
class TrackedPerson:
    """A person, or a robot that does not belong to the fleet, with all sightings.

    Attributes:
        person_id: Of the track: the same person as long as iVeg can tell.
        sightings: The newest of each chain of sightings; each has a ring of its own.
        began: The first sighting since they were last out of sight for a second.
        number: Counts tracks in the order of their appearance.
        places: Where they appeared and were lost each time that they were followed, the
            newest last: a glimpse, which may be a mistake, is none of them.
    """

    person_id: str
    class_: Class
    decision_id: str
    first_seen: Instant
    newest: Sighting
    sightings: tuple[Sighting, ...]
    began: Sighting
    number: int = 0
    places: tuple[Sighting, ...] = ()

    def age_s(self, now: Instant) -> float:
        """Seconds since the newest sighting by any robot."""
        return self.newest.age_s(now)

    @property
    def is_well_known(self) -> bool:
        """Whether they were followed, now or before."""
        return bool(self.places) or self.is_followed

    @property
    def followed_s(self) -> float:
        """For how long they have been in sight, faint looks among it (s)."""
        looked = 0.0 if self.began.looks is None else self.began.looks.over_s
        return looked + self.newest.at.mono - self.began.at.mono

    @property
    def is_followed(self) -> bool:
        """Whether they have been in sight for longer than a detector's mistake."""
        return self.followed_s >= MISTAKEN_S

    @property
    def last_places(self) -> tuple[Sighting, ...]:
        """Where they may have been lost: the last of all, or before a glimpse."""
        is_glimpse = self.places and not self.is_followed
        return (self.newest, self.places[-1]) if is_glimpse else (self.newest,)

    @property
    def middle(self) -> tuple[float, float]:
        """Of the places where it has been, in ``map`` (m)."""
        extent = self.newest.extent
        if extent is None:
            return self.newest.x, self.newest.y
        return extent.around.middle

    @property
    def is_possible(self) -> bool:
        """Whether every ring is one of looks alone."""
        rings = self.sightings
        return bool(rings) and all(one.possible for one in rings)

    def seen_as(
        self,
        newest: Sighting,
        sightings: tuple[Sighting, ...],
        decision_id: str | None = None,
        began: Sighting | None = None,
    ) -> "TrackedPerson":
        """The same person, seen otherwise.

        Args:
            newest: The newest sighting.
            sightings: The newest of each chain.
            decision_id: Of a new alert, if any.
            began: Where they appeared again, if that was before ``newest``.
        """
        is_back = newest.at.mono - self.newest.at.mono > LIMITS.seen_s
        return TrackedPerson(
            self.person_id,
            self.class_,
            decision_id or self.decision_id,
            self.first_seen,
            newest,
            sightings,
            (began or newest) if is_back else self.began,
            self.number,
            self._places_now if is_back and self.is_followed else self.places,
        )

    @property
    def _places_now(self) -> tuple[Sighting, ...]:
        return (*self.places, self.began, self.newest)[-_MOST_PLACES:]

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

    def rings(
        self, rule: DetectionRule, now: Instant
    ) -> Iterable[tuple[Sighting, float]]:
        """Every circle that protects this person, with its radius now (m)."""
        for sighting in self.sightings:
            age = sighting.age_s(now)
            if age <= sighting.lasts_s:
                # Asked thousands of times a second: nearly nobody is followed.
                if sighting.followed is not None:
                    age = sighting.ring_age_s(now)
                radius, reach = rule.radius_at(age), sighting.reach_m
                yield sighting, radius if radius >= reach else reach
