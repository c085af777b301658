"""Sightings become chains, chains become persons.

Each frame of one robot is taken in two layers.

*Chains* (protection).  A sighting continues the chain of its own observer whose last
sighting is near enough, and replaces that sighting alone; else it begins a chain.  Only
time or an all-clear ends a chain's ring.  Tracks play no part in it.

*Tracks* (names).  A chain that goes on keeps its track.  One that begins, or comes back
after a second, joins the nearest live track first (global assignment over the whole
picture), else the track that was lost where it appears, for as long as its mark stays
on the map, else it begins a track.  While that one is new it becomes the lost one that
most likely walked there (``recognition``).  Live tracks closer than half a metre become
one.  Two that were ever seen apart at once never do.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.tracking.assignment import assign
from iveg.domain.tracking.numbers import TrackNumbers
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.tracking.picture import (
    PlacedDetection,
    chain_cost,
    distance_between,
    first_places,
    is_replaced,
    live_cost,
    lost_cost,
)
from iveg.domain.tracking.recognition import Way, recognised, straight

MAX_PEOPLE, MAX_POSSIBLE, MAX_WALKERS = 256, 64, 32
"""Who counts by looks, and whom only lasers saw, take no place of others."""
MERGE_M = 0.5
_APART_M = 3.0
"""Farther from each other, at once, are two: beyond noise and a second's walk."""


@dataclass
class Tracker:
    """Every known person by id, in the order of appearance.

    Attributes:
        merge_m: Live tracks this near become one (m); below zero none do.
        numbers: Gives out ids.
        way: How far it is on foot.
    """

    merge_m: float = MERGE_M
    numbers: TrackNumbers = field(default_factory=TrackNumbers)
    way: Way = straight
    known: dict[str, TrackedPerson] = field(default_factory=dict)
    _chains: int = 0
    _tracks: int = 0
    _new: set[str] = field(default_factory=set)
    """Tracks that may yet turn out to be one of the lost."""
    _together: dict[str, set[str]] = field(default_factory=dict)

    def track_picture(
        self, picture: Sequence[PlacedDetection], at: Instant
    ) -> list[str | None]:
        """Assign each detection of a frame of one robot to a track.

        Returns:
            The track of each detection; None where no more can be kept.
        """
        chains = self._continue_chains(picture, at)
        tracks = self._choose_tracks(picture, chains, at)
        numbers: list[int] = []
        for index, (one, old) in enumerate(zip(picture, chains, strict=True)):
            first = one.first_place(index)
            # The chain of a further place has its first one's number, negative.
            number = self._number_of(old) if first == index else -numbers[first]
            numbers.append(number)
            tracks[index] = self._put(one, number, old, tracks[first], at)
        named = [track for track in tracks if track is not None]
        self._remember_together(named)
        merged = dict(self._merge(dict.fromkeys(named), at))
        merged |= dict(self._recognise(dict.fromkeys(named), at))
        return [_name_now(track, merged) for track in tracks]

    def drop(self, person_id: str, sighting: Sighting) -> TrackedPerson:
        """Drop a sighting whose place was seen to be empty."""
        person = self.known[person_id]
        left = tuple(earlier for earlier in person.sightings if earlier != sighting)
        person = self.known[person_id] = person.seen_as(person.newest, left)
        return person

    def exchange(self, person_id: str, old: Sighting, new: Sighting) -> None:
        """Know more of a sighting than before."""
        person = self.known[person_id]
        every = person.newest, *person.sightings
        newest, *kept = (new if one is old else one for one in every)
        self.known[person_id] = person.seen_as(newest, tuple(kept))

    def forget(self, now: Instant) -> list[TrackedPerson]:
        """Drop persons whose mark has had its time; returns them."""
        gone = [one for one in self.known.values() if one.stage(now) == "gone"]
        for person in gone:
            self._remove(person.person_id)
        return gone

    # --- chains -------------------------------------------------------------------

    def _continue_chains(
        self, picture: Sequence[PlacedDetection], at: Instant
    ) -> list[tuple[str, Sighting] | None]:
        """For each detection the earlier sighting that it replaces, and its track."""
        out: list[tuple[str, Sighting] | None] = [None] * len(picture)
        if not picture:
            return out
        observer = picture[0].sighting.observer
        own = [
            (person, earlier)
            for person in self.known.values()
            for earlier in person.sightings
            if earlier.observer == observer
            and earlier.chain > 0
            and earlier.age_s(at) <= LIMITS.ring_lasts_s
        ]
        for is_live in (True, False):
            wanting = [index for index in first_places(picture) if out[index] is None]
            if not wanting:
                break
            offered = [
                (person, earlier)
                for person, earlier in own
                if (earlier.age_s(at) <= LIMITS.seen_s) is is_live
            ]
            costs = [
                [chain_cost(picture[i], *pair, at) for pair in offered] for i in wanting
            ]
            for row, column in assign(costs):
                person, earlier = offered[column]
                out[wanting[row]] = person.person_id, earlier
        return [
            old if one.first_place(index) == index else self._beside(out, one)
            for index, (one, old) in enumerate(zip(picture, out, strict=True))
        ]

    def _beside(
        self, chains: Sequence[tuple[str, Sighting] | None], one: PlacedDetection
    ) -> tuple[str, Sighting] | None:
        """What a further place replaces: the one beside what its first replaces."""
        first = None if one.same_as is None else chains[one.same_as]
        if first is None:
            return None
        track, replaced = first
        for earlier in self.known[track].sightings:
            if earlier.chain == -replaced.chain:
                return track, earlier
        return None

    def _number_of(self, old: tuple[str, Sighting] | None) -> int:
        """Number of the chain that goes on, or of a new one."""
        if old is not None:
            return old[1].chain
        self._chains += 1
        return self._chains

    # --- tracks -------------------------------------------------------------------

    def _choose_tracks(
        self,
        picture: Sequence[PlacedDetection],
        chains: Sequence[tuple[str, Sighting] | None],
        at: Instant,
    ) -> list[str | None]:
        tracks: list[str | None] = [None] * len(picture)
        firsts = first_places(picture)
        for index in firsts:
            old = chains[index]
            if old is not None and old[1].age_s(at) <= LIMITS.seen_s:
                tracks[index] = old[0]
        self._assign_tracks(picture, tracks, at, is_live=True)
        taken = set(tracks)
        for index in firsts:
            old, of_no_place = chains[index], picture[index].sighting.reach_m
            if of_no_place and old is not None and old[0] not in taken:
                tracks[index] = old[0]
                taken.add(old[0])
        self._assign_tracks(picture, tracks, at, is_live=False)
        return tracks

    def _assign_tracks(
        self,
        picture: Sequence[PlacedDetection],
        tracks: list[str | None],
        at: Instant,
        *,
        is_live: bool,
    ) -> None:
        """Assign free tracks to detections without one."""
        wanting = [index for index in first_places(picture) if tracks[index] is None]
        if not wanting:
            return
        taken = set(tracks)
        offered = [
            person
            for person in self.known.values()
            if person.person_id not in taken
            and (person.age_s(at) <= LIMITS.seen_s) is is_live
            and (is_live or person.stage(at) != "gone")
        ]
        cost = live_cost if is_live else partial(lost_cost, way=self.way)
        costs = [[cost(picture[i], person, at) for person in offered] for i in wanting]
        for row, column in assign(costs):
            tracks[wanting[row]] = offered[column].person_id

    def _put(
        self,
        one: PlacedDetection,
        chain: int,
        old: tuple[str, Sighting] | None,
        track: str | None,
        at: Instant,
    ) -> str | None:
        """Keep a sighting in its track; its chain's earlier one is removed."""
        sighting = one.sighting.in_chain(chain, None if old is None else old[1])
        if old is not None:
            if old[1].at.mono > sighting.at.mono:
                return old[0]
            self.drop(*old)
        if track is None:
            return self._begin(one, sighting, at)
        person = self.known[track]
        if person.age_s(at) > LIMITS.seen_s:
            self._remember_apart(track, sighting, at)
        if old is None or old[0] != track:
            sighting = sighting.in_track(person)
        kept = tuple(
            earlier
            for earlier in person.sightings
            if earlier.age_s(at) <= LIMITS.ring_lasts_s
            and not is_replaced(earlier, sighting, at)
        )
        later = sighting.at.mono > person.newest.at.mono
        newest = sighting if later else person.newest
        had_ring = person.age_s(at) <= LIMITS.ring_lasts_s
        decision_id = person.decision_id if had_ring else one.decision_id
        self.known[track] = person.seen_as(newest, (*kept, sighting), decision_id)
        return track

    def _begin(
        self, one: PlacedDetection, sighting: Sighting, at: Instant
    ) -> str | None:
        if not self._has_room(at, sighting):
            return None
        self._tracks += 1
        kind = "P" if one.class_ == "person" else "R"
        track = self.numbers.next_id(kind, at, self.known)
        self.known[track] = TrackedPerson(
            track,
            one.class_,
            one.decision_id,
            at,
            sighting,
            (sighting,),
            sighting,
            self._tracks,
        )
        self._new.add(track)
        self._remember_apart(track, sighting, at)
        return track

    def _has_room(self, now: Instant, newest: Sighting) -> bool:
        """Whether one more can be kept, if need be in place of one without a ring.

        Persons with a ring, and persons who were seen twice, stay.  Who counts by looks
        or a laser alone takes no place from one who counts by a box.
        """
        walkers = sum(person.newest.laser for person in self.known.values())
        if newest.laser:
            return walkers < MAX_WALKERS
        possible = sum(person.is_possible for person in self.known.values())
        if newest.possible:
            return possible < MAX_POSSIBLE
        if len(self.known) - possible - walkers < MAX_PEOPLE:
            return True
        for person in self.known.values():
            once = person.first_seen == person.newest.at
            if once and person.stage(now) in ("last_seen", "gone"):
                self._remove(person.person_id)
                return True
        return False

    def _remove(self, track: str) -> None:
        del self.known[track]
        self._new.discard(track)
        for other in self._together.pop(track, ()):
            self._together[other].discard(track)

    # --- one person under two names -----------------------------------------------

    def _remember_together(self, tracks: Iterable[str]) -> None:
        """Remember that one picture showed all of these: they never merge."""
        shown = set(tracks)
        for track in shown:
            self._together.setdefault(track, set()).update(shown - {track})

    def _remember_apart(self, track: str, here: Sighting, at: Instant) -> None:
        """Remember who is in sight elsewhere as this one appears: they never merge."""
        for other in self.known.values():
            seen = other.newest
            if (
                other.age_s(at) <= LIMITS.seen_s
                and other.person_id != track
                and not (seen.reach_m or here.reach_m)
                and seen.recording == here.recording
                and distance_between(seen, here) > _APART_M
            ):
                self._together.setdefault(track, set()).add(other.person_id)
                self._together.setdefault(other.person_id, set()).add(track)

    def _merge(self, touched: Iterable[str], at: Instant) -> Iterator[tuple[str, str]]:
        """Join live tracks that stand at one spot; yields the changed names."""
        for track in touched:
            while track in self.known and (twin := self._twin_of(track, at)):
                first, second = sorted(
                    (track, twin), key=lambda name: self.known[name].number
                )
                self._join(first, second)
                yield second, first

    def _recognise(
        self, touched: Iterable[str], at: Instant
    ) -> Iterator[tuple[str, str]]:
        """Join new tracks to the lost ones that they are; yields the changed names."""
        for track in touched:
            if track not in self._new or self.known[track].age_s(at) > LIMITS.seen_s:
                continue
            person = self.known[track]
            found = recognised(person, self._lost_before(person), self.way)
            if found is not None:
                self._join(found.person_id, track, person.began)
                yield track, found.person_id
            elif person.is_followed:
                self._new.discard(track)

    def _lost_before(self, person: TrackedPerson) -> Iterator[TrackedPerson]:
        """Who may be this one: well known, and in no picture since it appeared."""
        apart, began = self._together.get(person.person_id, set()), person.began.at.mono
        for other in self.known.values():
            if (
                other.newest.at.mono < began
                and other.is_well_known
                and other.class_ == person.class_
                and other.newest.recording == person.newest.recording
                and other.person_id not in apart
            ):
                yield other

    def _twin_of(self, track: str, at: Instant) -> str | None:
        person, most = self.known[track], self.merge_m
        if person.newest.reach_m:
            return None
        apart, x, y = self._together.get(track, set()), person.newest.x, person.newest.y
        for other in self.known.values():
            if (
                # First what nearly all fail: in a storm this is asked of everybody.
                -most <= (newest := other.newest).x - x <= most
                and -most <= newest.y - y <= most
                and other is not person
                and other.class_ == person.class_
                and newest.recording == person.newest.recording
                and other.person_id not in apart
                and other.age_s(at) <= LIMITS.seen_s
                and not newest.reach_m
                and distance_between(newest, person.newest) <= most
            ):
                return other.person_id
        return None

    def _join(self, first: str, second: str, began: Sighting | None = None) -> None:
        """Every sighting of both is kept: names change, rings do not.

        ``began``: where the second appeared, who is in sight, and the first was lost.
        """
        older, younger = self.known[first], self.known[second]
        # What one of them knows of how far and fast they went, both know.
        found = [one.in_track(older) for one in (younger.newest, *younger.sightings)]
        newest = max(older.newest, found[0], key=lambda sighting: sighting.at.mono)
        sightings = (*older.sightings, *found[1:])
        self.known[first] = older.seen_as(newest, sightings, began=began)
        apart = self._together.get(second, set()) - {first}
        self._remove(second)
        self._together.setdefault(first, set()).update(apart)
        for other in apart:
            self._together[other].add(first)


def _name_now(track: str | None, merged: Mapping[str, str]) -> str | None:
    while track is not None and track in merged:
        track = merged[track]
    return track
