"""Multi-object tracking: sightings become chains, chains become tracks of persons.

Each frame of one robot is taken in two layers.

*Chains* (protection).  A sighting continues the chain of its own observer whose last
sighting is near enough, and replaces that sighting alone; else it begins a chain.  Only
time or its own camera ends a chain's zone.  Tracks play no part in it.

*Tracks* (names).  A chain that goes on keeps its track.  A new chain joins the nearest
live track (global assignment over the whole picture), else it begins a track: a person
who comes back after a gap has a new number.

Stages of a person::

    seen (<= 1 s) ──> remembered (<= 10 s, zone grows) ──> last seen (<= 600 s, no zone)
      ^________________________|                                 └──> gone

A person who was only glimpsed is gone sooner, or once the place is seen to be empty.
"""

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.geometry import Rectangle
from iveg.domain.limits import LIMITS, grown_radius
from iveg.domain.observations import Instant
from iveg.domain.parameters import Class
from iveg.domain.tracking.looks import Looks

# --- persons ----------------------------------------------------------------------

_SMOOTHED_S = 0.4
MISTAKEN_S = 2.5
"""Longest mistake of a detector (s); most of them last 2 s."""
LASER_LASTS_S = 3.0
"""Age up to which a sighting by laser has a zone (s).  A laser's person is a guess, and
a zone that grew for longer would slow passing robots for nothing."""
Stage = Literal["seen", "remembered", "last_seen", "gone"]


@dataclass(frozen=True, slots=True)
class Sighting:
    """The newest detection of one person by one robot, in ``map``.

    Attributes:
        x: Place in ``map`` (m); ``y`` and ``z`` likewise.
        at: Source moment on our clocks.
        looks: All looks at this person by then; None for a robot, and for a box that
            is too faint to be a look.
        reach_m: Range of the observer's camera (m) where the place is doubtful, and x
            and y are the observer's own; else 0.
        chain: Number of the chain of sightings whose newest this is.
        recording: Map frame of the recording that saw it; None: a robot of today.
        vx: Velocity of its chain in ``map`` (m/s); ``vy`` likewise.
        possible: Whether it counts by its looks alone, below the threshold.
        laser: Only the observer's laser saw it: it moves like somebody who walks.
        beyond_m: Half the box's longer side, less a person's radius (m); the zone is
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
        """Evidence that it counts by (looks alone, laser); equal along a chain."""
        return self.possible, self.laser

    @property
    def lasts_s(self) -> float:
        """Age up to which it has a zone (s)."""
        return LASER_LASTS_S if self.laser else LIMITS.zone_lasts_s

    def age_s(self, now: Instant) -> float:
        """Seconds since the sighting."""
        # Runs thousands of times a second: ``max`` takes three times as long.
        age_s = now.mono - self.at.mono
        return age_s if age_s > 0.0 else 0.0

    def in_chain(self, chain: int, before: "Sighting | None" = None) -> "Sighting":
        """This sighting as the newest of a chain, after the one ``before``."""
        vx, vy = (0.0, 0.0) if before is None else self._chain_velocity(before)
        return replace(self, chain=chain, vx=vx, vy=vy)

    def _chain_velocity(self, before: "Sighting") -> tuple[float, float]:
        """Velocity of the chain (m/s), smoothed over 0.4 s, a walker's at most."""
        after_s = self.at.mono - before.at.mono
        if not 0.0 < after_s <= LIMITS.seen_s or self.reach_m or before.reach_m:
            return 0.0, 0.0
        gain = after_s / (_SMOOTHED_S + after_s)
        vx = before.vx + gain * ((self.x - before.x) / after_s - before.vx)
        vy = before.vy + gain * ((self.y - before.y) / after_s - before.vy)
        share = min(1.0, LIMITS.walking_m_s / max(math.hypot(vx, vy), 1e-9))
        return vx * share, vy * share


@dataclass(frozen=True, slots=True)
class Extent:
    """Places, confidence and speed of all sightings that a track ever had.

    Attributes:
        around: Least rectangle in ``map`` that holds every place (m).
        surest: Greatest confidence (0 to 1).
        fastest: Greatest speed (m/s).
    """

    around: Rectangle
    surest: float
    fastest: float

    @classmethod
    def from_sighting(cls, sighting: Sighting) -> "Extent":
        """Extent of a single sighting."""
        x, y = sighting.x, sighting.y
        speed = math.hypot(sighting.vx, sighting.vy)
        return cls(Rectangle(x, y, x, y), sighting.confidence, speed)

    def joined(self, other: "Extent") -> "Extent":
        """Extent of both."""
        return Extent(
            self.around.joined(other.around),
            max(self.surest, other.surest),
            max(self.fastest, other.fastest),
        )


@dataclass(frozen=True, slots=True)
class TrackedPerson:
    """A person, or a robot that does not belong to the fleet, with all sightings.

    Attributes:
        person_id: Id of the track: the same person as long as iVeg can tell.
        sightings: The newest of each chain of sightings; each has a zone of its own.
        extent: Extent of every sighting since the first.
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
        """Stage of the track, by the age of its sightings."""
        age = self.age_s(now)
        if age <= LIMITS.seen_s:
            return "seen"
        # A glimpse whose place was seen to be empty leaves no mark.
        if not self.sightings and not self.is_well_known:
            return "gone"
        if age <= self.newest.lasts_s or any(
            sighting.age_s(now) <= sighting.lasts_s for sighting in self.sightings
        ):
            return "remembered"
        lasts_s = LIMITS.last_seen_s if self.is_well_known else LIMITS.glimpsed_s
        return "last_seen" if age <= lasts_s else "gone"

    def observers(self, now: Instant) -> list[str]:
        """Robots that see this person now, in the order of their sightings."""
        return list(
            dict.fromkeys(
                sighting.observer
                for sighting in self.sightings
                if sighting.age_s(now) <= LIMITS.seen_s
            )
        )

    def zone_radii(
        self, rule: DetectionRule, now: Instant
    ) -> Iterable[tuple[Sighting, float]]:
        """Every zone that protects this person, with its radius now (m)."""
        fresh_m = rule.radius_m.for_class(self.class_)
        for sighting in self.sightings:
            age = sighting.age_s(now)
            if age <= sighting.lasts_s:
                radius_m = grown_radius(fresh_m, age) + sighting.beyond_m
                # At a doubtful place somebody may be anywhere in the camera's range.
                yield sighting, max(radius_m, sighting.reach_m)


# --- numbers ----------------------------------------------------------------------

_DAY_S = 86400.0


@dataclass(slots=True)
class TrackNumbers:
    """Gives out ids of tracks.

    Attributes:
        era: Last part of every id, with the day, so that no later start repeats one.
    """

    era: str = ""
    _day: int = -1
    _shown: int = 0

    def next_id(self, kind: str, at: Instant, known: Iterable[str]) -> str:
        """A new id, whose number no ``known`` id has."""
        day = int(at.wall // _DAY_S)
        if day != self._day:
            self._day, self._shown = day, 0
        in_use = {track.partition("-")[0] for track in known}
        self._shown += 1
        while f"{kind}{self._shown}" in in_use:
            self._shown += 1
        return f"{kind}{self._shown}" + (self.era and f"{self.era}{day:x}")


# --- assignment -------------------------------------------------------------------
#
# The most pairs possible, at the least sum of costs: the Hungarian method by shortest
# augmenting paths with potentials (Kuhn 1955; Jonker and Volgenant 1987), O(n^3);
# pictures hold few people, so n is small.

_NEVER = 1e9
"""Cost of an impossible pair, far above any sum of distances (m)."""
_FREE = -1


def assign(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]]:
    """Pair rows with columns.

    Args:
        costs: Shape (rows, columns); ``inf`` where a pair is impossible.

    Returns:
        Pairs (row, column) in the order of rows, each row and column at most once.
    """
    if not costs or not costs[0]:
        return []
    # Most pictures hold a single detection, which takes the nearest.
    if len(costs) == 1:
        least = min(costs[0])
        return [(0, costs[0].index(least))] if math.isfinite(least) else []
    table = np.minimum(np.array(costs), _NEVER)
    if len(costs) > len(costs[0]):
        pairs = sorted((row, column) for column, row in _matched(table.T))
    else:
        pairs = _matched(table)
    return [(row, column) for row, column in pairs if math.isfinite(costs[row][column])]


def _matched(costs: NDArray[np.float64]) -> list[tuple[int, int]]:
    """The column of each row; there are at least as many columns as rows."""
    rows, columns = costs.shape
    row_potential, column_potential = np.zeros(rows), np.zeros(columns)
    row_of, column_of = np.full(columns, _FREE), np.full(rows, _FREE)
    for new in range(rows):
        least, before = np.full(columns, math.inf), np.full(columns, _FREE)
        reached, done = [], np.zeros(columns, np.bool_)
        row, length = new, 0.0
        while row != _FREE:
            reached.append(row)
            reduced = length + costs[row] - row_potential[row] - column_potential
            nearer = ~done & (reduced < least)
            least[nearer], before[nearer] = reduced[nearer], row
            column = int(np.where(done, math.inf, least).argmin())
            length, done[column] = float(least[column]), True
            row = int(row_of[column])
        row_potential[new] += length
        earlier = reached[1:]
        row_potential[earlier] += length - least[column_of[earlier]]
        column_potential[done] -= length - least[done]
        while column != _FREE:  # every row on the way takes the next column
            row = int(before[column])
            row_of[column] = row
            column_of[row], column = column, int(column_of[row])
    return [(row, int(column)) for row, column in enumerate(column_of)]


# --- distances --------------------------------------------------------------------

GATE_M, GATE_CAP_M = 1.0, 2.0


@dataclass(frozen=True, slots=True)
class PlacedDetection:
    """One confident detection of a picture.

    Attributes:
        decision_id: Id of the alert, if this begins a track.
    """

    class_: Class
    sighting: Sighting
    decision_id: str


_Chain = tuple[str, Sighting]
"""A chain that goes on: its track, and the sighting that is replaced in it."""


def _is_alike(person: TrackedPerson, detection: PlacedDetection) -> bool:
    """Whether both have the same class and map, so that they may be the same."""
    frame = person.newest.recording
    return person.class_ == detection.class_ and frame == detection.sighting.recording


def _chain_cost(
    detection: PlacedDetection, person: TrackedPerson, earlier: Sighting, at: Instant
) -> float:
    """Distance to the observer's own earlier sighting (m); inf for another person's.

    A sighting that counts by its looks alone replaces none that counts by its box:
    looks add zones, and take none away.  A laser may see somebody else than a camera.
    """
    here = detection.sighting
    if not _is_alike(person, detection) or bool(earlier.reach_m) != bool(here.reach_m):
        return math.inf
    if earlier.kind != here.kind:
        return math.inf
    return 0.0 if earlier.reach_m else _gated(earlier, here, at)


def _live_cost(detection: PlacedDetection, person: TrackedPerson, at: Instant) -> float:
    """Distance to the nearest fresh sighting by any robot (m); inf beyond its gate.

    Where two robots see one person with noise, a detection that lies far from the first
    sighting seldom lies far from both.
    """
    here = detection.sighting
    if not _is_alike(person, detection) or here.reach_m:
        return math.inf
    fresh = (
        earlier
        for earlier in person.sightings
        if not earlier.reach_m and earlier.age_s(at) <= LIMITS.seen_s
    )
    return min((_gated(earlier, here, at) for earlier in fresh), default=math.inf)


def _gated(earlier: Sighting, here: Sighting, at: Instant) -> float:
    """Distance to an earlier sighting (m); inf if nobody walks so far in the time."""
    # A cheap test first: most pairs are far apart.
    if abs(earlier.x - here.x) > GATE_CAP_M:
        return math.inf
    walked_m = LIMITS.walking_m_s * abs(at.mono - earlier.at.mono)
    distance = _distance(earlier, here)
    return distance if distance <= min(GATE_CAP_M, GATE_M + walked_m) else math.inf


def _distance(first: Sighting, second: Sighting) -> float:
    """Horizontal distance between two sightings (m)."""
    return math.hypot(first.x - second.x, first.y - second.y)


# --- tracks -----------------------------------------------------------------------

MAX_PEOPLE, MAX_POSSIBLE, MAX_LASER_TRACKS = 256, 64, 8
"""Most people by boxes, by looks alone, and by the laser of each robot.  The bounds are
separate, so that weak evidence takes no place of strong evidence."""


@dataclass
class Tracker:
    """Every known person by id, in the order of appearance.

    Attributes:
        numbers: Source of ids.
    """

    numbers: TrackNumbers = field(default_factory=TrackNumbers)
    known: dict[str, TrackedPerson] = field(default_factory=dict)
    _chains: int = 0

    def track_picture(
        self, picture: Sequence[PlacedDetection], at: Instant
    ) -> list[str | None]:
        """Assign each detection of a frame of one robot to a track.

        Returns:
            The track of each detection; None where no more can be kept.
        """
        chains = self._continued_chains(picture, at)
        tracks = self._joined_tracks(picture, chains, at)
        return [
            self._continue(detection, *chains[index], at)
            if index in chains
            else self._join(detection, tracks.get(index), at)
            for index, detection in enumerate(picture)
        ]

    def drop(self, person_id: str, sighting: Sighting) -> TrackedPerson:
        """Drop a sighting whose place its own camera saw to be empty."""
        person = self.known[person_id]
        sightings = tuple(old for old in person.sightings if old != sighting)
        person = self.known[person_id] = replace(person, sightings=sightings)
        return person

    def forget(self, now: Instant) -> list[TrackedPerson]:
        """Drop persons whose stage is ``gone``; returns them."""
        gone = [person for person in self.known.values() if person.stage(now) == "gone"]
        for person in gone:
            del self.known[person.person_id]
        return gone

    def _continued_chains(
        self, picture: Sequence[PlacedDetection], at: Instant
    ) -> dict[int, _Chain]:
        """The earlier sighting that a detection replaces, and its track, by index.

        Persons in sight are matched before persons who are only remembered.
        """
        own_chains = [
            (person, earlier)
            for person in self.known.values()
            for earlier in person.sightings
            if picture
            and earlier.observer == picture[0].sighting.observer
            and earlier.age_s(at) <= LIMITS.zone_lasts_s
        ]
        # Of two equally near chains the older goes on, whatever other robots saw.
        own_chains.sort(key=lambda pair: pair[1].chain)
        chains: dict[int, _Chain] = {}
        for is_live in (True, False):
            unmatched = _without(picture, chains)
            candidates = [
                (person, earlier)
                for person, earlier in own_chains
                if (earlier.age_s(at) <= LIMITS.seen_s) is is_live
            ]
            costs = [
                [_chain_cost(picture[i], *pair, at) for pair in candidates]
                for i in unmatched
            ]
            for row, column in assign(costs):
                person, earlier = candidates[column]
                chains[unmatched[row]] = person.person_id, earlier
        return chains

    def _joined_tracks(
        self,
        picture: Sequence[PlacedDetection],
        chains: Mapping[int, _Chain],
        at: Instant,
    ) -> dict[int, str]:
        """Live tracks that the other detections of a picture join, by index."""
        taken_tracks = {track for track, _ in chains.values()}
        unmatched = _without(picture, chains)
        live = [
            person
            for person in self.known.values()
            if unmatched
            and person.person_id not in taken_tracks
            and person.age_s(at) <= LIMITS.seen_s
        ]
        costs = [
            [_live_cost(picture[i], person, at) for person in live] for i in unmatched
        ]
        return {unmatched[row]: live[column].person_id for row, column in assign(costs)}

    def _continue(
        self, detection: PlacedDetection, track: str, earlier: Sighting, at: Instant
    ) -> str:
        """Replace the earlier sighting of a chain, unless the detection is older."""
        if earlier.at.mono <= detection.sighting.at.mono:
            sighting = detection.sighting.in_chain(earlier.chain, earlier)
            self._add(detection, track, sighting, at, in_place_of=earlier)
        return track

    def _join(
        self, detection: PlacedDetection, track: str | None, at: Instant
    ) -> str | None:
        """Begin a chain, in this track or in a new track."""
        self._chains += 1
        sighting = detection.sighting.in_chain(self._chains)
        if track is None:
            return self._begin(detection, sighting, at)
        self._add(detection, track, sighting, at)
        return track

    def _add(
        self,
        detection: PlacedDetection,
        track: str,
        sighting: Sighting,
        at: Instant,
        in_place_of: Sighting | None = None,
    ) -> None:
        """Add the newest sighting of a chain to its track."""
        person = self.known[track]
        remaining = tuple(
            earlier
            for earlier in person.sightings
            if earlier.age_s(at) <= LIMITS.zone_lasts_s and earlier != in_place_of
        )
        # While a camera sees a person, a laser's sighting does not become the newest.
        is_beside = sighting.laser and not person.newest.laser
        is_beside &= person.age_s(at) <= LIMITS.seen_s
        later = sighting.at.mono > person.newest.at.mono and not is_beside
        # After a time without a zone the person is a new alert, with its own decision.
        had_zone = person.age_s(at) <= LIMITS.zone_lasts_s
        self.known[track] = replace(
            person,
            newest=sighting if later else person.newest,
            sightings=(*remaining, sighting),
            decision_id=person.decision_id if had_zone else detection.decision_id,
            extent=person.extent.joined(Extent.from_sighting(sighting)),
        )

    def _begin(
        self, detection: PlacedDetection, sighting: Sighting, at: Instant
    ) -> str | None:
        if not self._has_room(at, sighting):
            return None
        self._end_marks(detection, at)
        kind = "P" if detection.class_ == "person" else "R"
        track = self.numbers.next_id(kind, at, self.known)
        self.known[track] = TrackedPerson(
            track,
            detection.class_,
            detection.decision_id,
            at,
            sighting,
            (sighting,),
            Extent.from_sighting(sighting),
        )
        return track

    def _end_marks(self, detection: PlacedDetection, at: Instant) -> None:
        """Forget marks of people who were last seen where somebody is seen now."""
        for person in list(self.known.values()):
            last, here = person.newest, detection.sighting
            is_mark = person.stage(at) == "last_seen" and _is_alike(person, detection)
            is_placed = not (last.reach_m or here.reach_m)
            if is_mark and is_placed and _distance(last, here) <= GATE_M:
                del self.known[person.person_id]

    def _has_room(self, now: Instant, newest: Sighting) -> bool:
        """Whether another person can be kept; a glimpsed one without a zone gives way.

        Persons with a zone stay, and so do persons whom boxes showed twice.
        """
        others = [
            person for person in self.known.values() if _shares_room(person, newest)
        ]
        if len(others) < _room_for(newest):
            return True
        for person in others:
            was_glimpsed = newest.laser or person.first_seen == person.newest.at
            if was_glimpsed and person.stage(now) in ("last_seen", "gone"):
                del self.known[person.person_id]
                return True
        return False


def _shares_room(person: TrackedPerson, newest: Sighting) -> bool:
    """Whether both count by the same evidence, by laser also by the same robot's."""
    known = person.newest
    is_of_robot = not known.laser or known.observer == newest.observer
    return known.kind == newest.kind and is_of_robot


def _room_for(newest: Sighting) -> int:
    """Bound of people who count by the evidence of this sighting."""
    if newest.laser:
        return MAX_LASER_TRACKS
    return MAX_POSSIBLE if newest.possible else MAX_PEOPLE


def _without(picture: Sequence[PlacedDetection], chains: Container[int]) -> list[int]:
    """Indices of the detections that continue no chain."""
    return [index for index in range(len(picture)) if index not in chains]
