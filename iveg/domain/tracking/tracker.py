"""Sightings become chains, chains become persons.

Each frame of one robot is taken in two layers.

*Chains* (protection).  A sighting continues the chain of its own observer whose last
sighting is near enough, and replaces that sighting alone; else it begins a chain.  Only
time or its own camera ends a chain's zone.  Tracks play no part in it.

*Tracks* (names).  A chain that goes on keeps its track.  One that begins joins the
nearest live track (global assignment over the whole picture), else it begins a track: a
person who comes back after a gap has a new number.
"""

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.parameters import Class
from iveg.domain.tracking.person import Extent, Sighting, TrackedPerson

_DAY_S = 86400.0


@dataclass(slots=True)
class TrackNumbers:
    """Gives out ids.

    Attributes:
        era: Ends every id, with the day, so that no later start makes the same one.
    """

    era: str = ""
    _day: int = -1
    _shown: int = 0

    def next_id(self, kind: str, at: Instant, known: Iterable[str]) -> str:
        """A new id; its number is none of those that are ``known``."""
        day = int(at.wall // _DAY_S)
        if day != self._day:
            self._day, self._shown = day, 0
        in_use = {one.partition("-")[0] for one in known}
        self._shown += 1
        while f"{kind}{self._shown}" in in_use:
            self._shown += 1
        return f"{kind}{self._shown}" + (self.era and f"{self.era}{day:x}")


# --- assignment -------------------------------------------------------------------
#
# As many pairs as can be, and of those the cheapest in sum: the Hungarian method by
# shortest augmenting paths with potentials (Kuhn 1955; Jonker and Volgenant 1987),
# O(n^3); pictures hold few people, so n is small.

_NEVER = 1e9
"""Stands for a pair that cannot be; far above any sum of distances (m)."""
_FREE = -1


def assign(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]]:
    """Pair rows with columns.

    Args:
        costs: Shape (rows, columns); ``inf`` where a pair cannot be.

    Returns:
        Pairs (row, column) in the order of rows, each row and column once at most.
    """
    if not costs or not costs[0]:
        return []
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
        decision_id: Of the alert, should this begin a track.
    """

    class_: Class
    sighting: Sighting
    decision_id: str


_Chain = tuple[str, Sighting]
"""A chain that goes on: its track, and the sighting that is replaced."""


def _is_alike(person: TrackedPerson, one: PlacedDetection) -> bool:
    """Whether they can be one: of a class, and of the same map."""
    frame = person.newest.recording
    return person.class_ == one.class_ and frame == one.sighting.recording


def _chain_cost(
    one: PlacedDetection, person: TrackedPerson, earlier: Sighting, at: Instant
) -> float:
    """Distance to the observer's own earlier sighting (m); inf for another person's.

    A sighting that counts by its looks alone replaces none that counts by its box:
    looks add zones, and take none away.  A laser may see somebody else than a camera.
    """
    here = one.sighting
    if not _is_alike(person, one) or bool(earlier.reach_m) != bool(here.reach_m):
        return math.inf
    if earlier.kind != here.kind:
        return math.inf
    return 0.0 if earlier.reach_m else _gated(earlier, here, at)


def _live_cost(one: PlacedDetection, person: TrackedPerson, at: Instant) -> float:
    """Distance to the nearest fresh sighting by anybody (m); inf beyond its gate.

    Where two robots see one person with noise, a detection that lies far from the one
    sighting seldom lies far from both.
    """
    here = one.sighting
    if not _is_alike(person, one) or here.reach_m:
        return math.inf
    fresh = (
        earlier
        for earlier in person.sightings
        if not earlier.reach_m and earlier.age_s(at) <= LIMITS.seen_s
    )
    return min((_gated(earlier, here, at) for earlier in fresh), default=math.inf)


def _gated(earlier: Sighting, here: Sighting, at: Instant) -> float:
    """Distance to an earlier sighting (m); inf if nobody walked so far since."""
    if abs(earlier.x - here.x) > GATE_CAP_M:
        return math.inf
    walked_m = LIMITS.walking_m_s * abs(at.mono - earlier.at.mono)
    distance = _distance(earlier, here)
    return distance if distance <= min(GATE_CAP_M, GATE_M + walked_m) else math.inf


def _distance(one: Sighting, other: Sighting) -> float:
    """Horizontal distance between two sightings (m)."""
    return math.hypot(one.x - other.x, one.y - other.y)


# --- tracks -----------------------------------------------------------------------

MAX_PEOPLE, MAX_POSSIBLE, MAX_WALKERS = 256, 64, 8
"""People who count by looks, and whom only lasers saw, take no place of others; of the
last each robot has its own places, so that none takes another's."""


@dataclass
class Tracker:
    """Every known person by id, in the order of appearance.

    Attributes:
        numbers: Gives out ids.
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
            self._continue(one, *chains[index], at)
            if index in chains
            else self._join(one, tracks.get(index), at)
            for index, one in enumerate(picture)
        ]

    def drop(self, person_id: str, sighting: Sighting) -> TrackedPerson:
        """Drop a sighting whose place its own camera saw to be empty."""
        person = self.known[person_id]
        left = tuple(earlier for earlier in person.sightings if earlier != sighting)
        person = self.known[person_id] = replace(person, sightings=left)
        return person

    def forget(self, now: Instant) -> list[TrackedPerson]:
        """Drop persons whose mark has had its time; returns them."""
        gone = [one for one in self.known.values() if one.stage(now) == "gone"]
        for person in gone:
            del self.known[person.person_id]
        return gone

    def _continued_chains(
        self, picture: Sequence[PlacedDetection], at: Instant
    ) -> dict[int, _Chain]:
        """The earlier sighting that a detection replaces, and its track, by index.

        Whoever is in sight goes before whoever is only remembered.
        """
        own = [
            (person, earlier)
            for person in self.known.values()
            for earlier in person.sightings
            if picture
            and earlier.observer == picture[0].sighting.observer
            and earlier.age_s(at) <= LIMITS.zone_lasts_s
        ]
        # Of two that are equally near the older goes on, whatever other robots saw.
        own.sort(key=lambda pair: pair[1].chain)
        chains: dict[int, _Chain] = {}
        for is_live in (True, False):
            wanting = _without(picture, chains)
            offered = [
                (person, earlier)
                for person, earlier in own
                if (earlier.age_s(at) <= LIMITS.seen_s) is is_live
            ]
            costs = [
                [_chain_cost(picture[i], *pair, at) for pair in offered]
                for i in wanting
            ]
            for row, column in assign(costs):
                person, earlier = offered[column]
                chains[wanting[row]] = person.person_id, earlier
        return chains

    def _joined_tracks(
        self,
        picture: Sequence[PlacedDetection],
        chains: Mapping[int, _Chain],
        at: Instant,
    ) -> dict[int, str]:
        """Live tracks that the other detections of a picture join, by index."""
        taken = {track for track, _ in chains.values()}
        wanting = _without(picture, chains)
        live = [
            person
            for person in self.known.values()
            if wanting
            and person.person_id not in taken
            and person.age_s(at) <= LIMITS.seen_s
        ]
        costs = [
            [_live_cost(picture[i], person, at) for person in live] for i in wanting
        ]
        return {wanting[row]: live[column].person_id for row, column in assign(costs)}

    def _continue(
        self, one: PlacedDetection, track: str, earlier: Sighting, at: Instant
    ) -> str:
        """Replace the earlier sighting of a chain, unless this one is older."""
        if earlier.at.mono <= one.sighting.at.mono:
            self.drop(track, earlier)
            self._add(one, track, one.sighting.in_chain(earlier.chain, earlier), at)
        return track

    def _join(self, one: PlacedDetection, track: str | None, at: Instant) -> str | None:
        """Begin a chain in a track, or in one of its own."""
        self._chains += 1
        sighting = one.sighting.in_chain(self._chains)
        if track is None:
            return self._begin(one, sighting, at)
        self._add(one, track, sighting, at)
        return track

    def _add(
        self, one: PlacedDetection, track: str, sighting: Sighting, at: Instant
    ) -> None:
        """Add the newest sighting of a chain to its track."""
        person = self.known[track]
        kept = tuple(
            earlier
            for earlier in person.sightings
            if earlier.age_s(at) <= LIMITS.zone_lasts_s
        )
        # Where a camera sees somebody, what a laser sees there says no more of them.
        is_beside = sighting.laser and not person.newest.laser
        is_beside &= person.age_s(at) <= LIMITS.seen_s
        later = sighting.at.mono > person.newest.at.mono and not is_beside
        had_zone = person.age_s(at) <= LIMITS.zone_lasts_s
        self.known[track] = replace(
            person,
            newest=sighting if later else person.newest,
            sightings=(*kept, sighting),
            decision_id=person.decision_id if had_zone else one.decision_id,
            extent=person.extent.joined(Extent.of(sighting)),
        )

    def _begin(
        self, one: PlacedDetection, sighting: Sighting, at: Instant
    ) -> str | None:
        if not self._has_room(at, sighting):
            return None
        self._end_marks(one, sighting, at)
        kind = "P" if one.class_ == "person" else "R"
        track = self.numbers.next_id(kind, at, self.known)
        self.known[track] = TrackedPerson(
            track,
            one.class_,
            one.decision_id,
            at,
            sighting,
            (sighting,),
            Extent.of(sighting),
        )
        return track

    def _end_marks(self, one: PlacedDetection, here: Sighting, at: Instant) -> None:
        """Forget marks of people who were last seen where somebody is seen now."""
        for person in list(self.known.values()):
            last = person.newest
            is_mark = person.stage(at) == "last_seen" and _is_alike(person, one)
            is_placed = not (last.reach_m or here.reach_m)
            if is_mark and is_placed and _distance(last, here) <= GATE_M:
                del self.known[person.person_id]

    def _has_room(self, now: Instant, newest: Sighting) -> bool:
        """Whether one more can be kept, if need be in place of one without a zone.

        Persons with a zone stay, and so do those whom boxes showed twice.
        """
        others = [one for one in self.known.values() if _shares_room(one, newest)]
        if len(others) < _most_of(newest):
            return True
        for one in others:
            was_glimpsed = newest.laser or one.first_seen == one.newest.at
            if was_glimpsed and one.stage(now) in ("last_seen", "gone"):
                del self.known[one.person_id]
                return True
        return False


def _shares_room(person: TrackedPerson, newest: Sighting) -> bool:
    """Whether both count by the same evidence; by lasers, by that of one robot."""
    known = person.newest
    is_of_robot = not known.laser or known.observer == newest.observer
    return known.kind == newest.kind and is_of_robot


def _most_of(newest: Sighting) -> int:
    """Number of people who may count by the evidence of a sighting."""
    if newest.laser:
        return MAX_WALKERS
    return MAX_POSSIBLE if newest.possible else MAX_PEOPLE


def _without(picture: Sequence[PlacedDetection], found: Container[int]) -> list[int]:
    """Indices of the detections for which nothing was found."""
    return [index for index in range(len(picture)) if index not in found]
