"""One picture as the tracker takes it, and its distances to who is known already."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from iveg.domain.detection_rule import Class
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.tracking.recognition import Way

GATE_M, GATE_CAP_M = 1.0, 2.0


@dataclass(frozen=True, slots=True)
class PlacedDetection:
    """One confident detection of a picture.

    Attributes:
        decision_id: Of the alert, should this begin a track.
        same_as: Index in the picture of the first place of the same box, which may be
            its own; None: its own.  Every further place joins the track of the first.
    """

    class_: Class
    sighting: Sighting
    decision_id: str
    same_as: int | None = None

    def first_place(self, index: int) -> int:
        """Index of the first place of its box; ``index`` is its own."""
        return index if self.same_as is None else self.same_as


def first_places(picture: Sequence[PlacedDetection]) -> list[int]:
    """Indices of the boxes' first places."""
    return [
        index for index, one in enumerate(picture) if one.first_place(index) == index
    ]


def is_alike(person: TrackedPerson, one: PlacedDetection) -> bool:
    """Whether they can be one: of a class, and of the same map."""
    frame = person.newest.recording
    return person.class_ == one.class_ and frame == one.sighting.recording


def chain_cost(
    one: PlacedDetection, person: TrackedPerson, earlier: Sighting, at: Instant
) -> float:
    """Distance to the observer's own earlier sighting (m); inf for another person's.

    A sighting that counts by its looks alone replaces none that counts by its box:
    looks add rings, and take none away.
    """
    here = one.sighting
    # First what nearly all fail: in a storm this is asked of everybody.
    is_placed = not (earlier.reach_m or here.reach_m)
    if is_placed and not (
        -GATE_CAP_M <= earlier.x - here.x <= GATE_CAP_M
        and -GATE_CAP_M <= earlier.y - here.y <= GATE_CAP_M
    ):
        return math.inf
    if not is_alike(person, one) or bool(earlier.reach_m) != bool(here.reach_m):
        return math.inf
    # A laser may see another one: what a camera saw stays.
    if (earlier.possible, earlier.laser) != (here.possible, here.laser):
        return math.inf
    if earlier.reach_m:
        return 0.0
    distance = distance_between(earlier, here)
    return distance if distance <= _gate(earlier, at) else math.inf


def is_replaced(earlier: Sighting, sighting: Sighting, at: Instant) -> bool:
    """Whether a box shows where somebody is who counted by the observer's looks."""
    return (
        earlier.possible
        and not sighting.possible
        and earlier.observer == sighting.observer
        and not (earlier.reach_m or sighting.reach_m)
        and distance_between(earlier, sighting) <= _gate(earlier, at)
    )


def live_cost(one: PlacedDetection, person: TrackedPerson, at: Instant) -> float:
    """Distance to the nearest fresh sighting by anybody (m); inf beyond its gate.

    Where two robots see one person with noise, a detection that lies far from the one
    sighting seldom lies far from both.
    """
    here = one.sighting
    if not is_alike(person, one) or here.reach_m:
        return math.inf
    return min(
        (
            distance
            for earlier in person.sightings
            # First what nearly all fail: in a storm this is asked of everybody.
            if abs(earlier.x - here.x) <= GATE_CAP_M
            and abs(earlier.y - here.y) <= GATE_CAP_M
            and not earlier.reach_m
            and earlier.age_s(at) <= LIMITS.seen_s
            and (distance := distance_between(earlier, here)) <= _gate(earlier, at)
        ),
        default=math.inf,
    )


def lost_cost(
    one: PlacedDetection, person: TrackedPerson, at: Instant, way: Way
) -> float:
    """How far from where somebody was lost (m); inf beyond its gate.

    So near, and by a way so short, it is taken for the same one at once; who comes from
    farther is known again when they have been in sight for a while (``recognition``).
    """
    if not is_alike(person, one) or one.sighting.reach_m:
        return math.inf
    return min(_near(one.sighting, last, at, way) for last in person.last_places)


def _near(here: Sighting, last: Sighting, at: Instant, way: Way) -> float:
    gate = _gate(last, at)
    if last.reach_m or distance_between(last, here) > gate:
        return math.inf
    distance = way(last.x, last.y, here.x, here.y)
    return distance if distance <= gate else math.inf


def distance_between(one: Sighting, other: Sighting) -> float:
    """Horizontal distance between two sightings (m)."""
    return math.hypot(one.x - other.x, one.y - other.y)


def _gate(earlier: Sighting, at: Instant) -> float:
    """How far one may have walked since a sighting (m, capped)."""
    return min(GATE_CAP_M, GATE_M + LIMITS.walking_m_s * abs(at.mono - earlier.at.mono))
