"""Lines of sight: cameras, crop, and the all-clear of an empty spot.

A ring goes by time or because a robot has had its centre in view for a second and found
nobody, not even faintly; never for one missing frame (docs/safety.md, "Age").  What a
camera does not look at a laser may have swept (``laser_sight``).
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.following import Following, Unexplained
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.witness import KnownBody
from iveg.domain.world import World

CLEAR_S = 1.0
_EDGE_RAD = math.radians(5.0)
"""So far inside the picture that a person there would be seen whole."""
_NEAR_M, _RANGE_SHARE = 1.0, 0.75
_FRESH_LOOK_S = 0.5
_PERSON_M = 0.6
"""About the centre of a person's box: half of a person, and the error of the box."""
_BODY_M = 0.3
"""Half of a person, whose middle keeps so far from what stands there."""
_YOUNG_S = 0.5
"""An older sighting says too little of where somebody is to explain a return."""

_Look = tuple[int, str]
_Spots = NDArray[np.float64]
_Place = tuple[float, float]
_NONE = np.empty(0, np.intp)
Swept = Callable[
    [RobotState, _Spots, NDArray[np.float64], Sequence[KnownBody], Instant],
    NDArray[np.intp],
]
"""Robot, spots, ages of their sightings (s), whom somebody sees by now, now → the spots
that its newest scan shows to be empty."""


class AllClear:
    """Takes old sightings away once their place was seen to be empty.

    Args:
        swept: Asks a robot's laser; nobody's counts if left out.
        unexplained: Asks it whom it has in sight; likewise.
    """

    def __init__(
        self,
        swept: Swept = lambda *_: _NONE,
        unexplained: Unexplained = lambda *_: None,
    ) -> None:
        self._swept, self._following = swept, Following(unexplained)
        self._since: dict[_Look, float] = {}
        self._places: dict[int, tuple[Sighting, Sequence[_Place]]] = {}
        """By chain the sighting, and where to look for who was seen there."""

    def sweep(
        self, people: People, world: World, greenhouse: Greenhouse, now: Instant
    ) -> list[TrackedPerson]:
        """Remove rings whose centre is seen to be empty; returns their persons."""
        self._following.tick(people, world, now)
        watched: dict[_Look, float] = {}
        empty: set[int] = set()
        rings = [
            (person, sighting)
            for person in people.known.values()
            for sighting in person.sightings
            if _may_go(sighting, world, now)
        ]
        self._places = {
            ring.chain: self._places_of(ring, world, greenhouse) for _, ring in rings
        }
        looks = _Looks.at([(*one, self._places[one[1].chain][1]) for one in rings], now)
        groups = _groups(rings, people, now)
        for robot in world.live_robots() if rings else ():
            seen = looks.seen(visible_from(robot, looks.spots, greenhouse, now))
            for is_in, bodies in groups:
                which = np.flatnonzero(is_in[looks.of])
                asked = looks.spots[which], looks.ages[which], bodies, now
                seen |= looks.seen(which[self._swept(robot, *asked)])
            for index in sorted(seen):
                person, sighting = rings[index]
                if people.is_suspected(person, sighting, robot.robot_id):
                    continue
                pair = sighting.chain, robot.robot_id
                watched[pair] = self._since.get(pair, now.mono)
                if now.mono - watched[pair] >= CLEAR_S:
                    empty.add(index)
        self._since = watched
        ended = [rings[index] for index in sorted(empty)]
        for _, sighting in ended:
            _hand_over(sighting, people, now)
        return [
            people.drop_sighting(person.person_id, sighting)
            for person, sighting in ended
        ]

    def _places_of(
        self, sighting: Sighting, world: World, greenhouse: Greenhouse
    ) -> tuple[Sighting, Sequence[_Place]]:
        """Where to look for somebody, as it was when that was asked first."""
        known = self._places.get(sighting.chain)
        if known is not None and known[0].at == sighting.at:
            return known
        odometry = world.robot(sighting.observer).odometry
        if odometry is None or sighting.laser:
            return sighting, ((sighting.x, sighting.y),)
        return sighting, beside(greenhouse, sighting.x, sighting.y, odometry.pose)


@dataclass(frozen=True, slots=True, eq=False)
class _Looks:
    """Where to look for those who have rings.

    Attributes:
        spots: Shape (n, 2), in ``map`` (m); it takes all of a ring.
        of: Shape (n,): whose ring each is; ``ages`` how old that is (s).
        counts: How many each ring has.
    """

    spots: _Spots
    of: NDArray[np.intp]
    ages: NDArray[np.float64]
    counts: Sequence[int]

    @classmethod
    def at(
        cls,
        rings: Sequence[tuple[TrackedPerson, Sighting, Sequence[_Place]]],
        now: Instant,
    ) -> "_Looks":
        """The places of each ring."""
        counts = [len(places) for *_, places in rings]
        spots = [place for *_, places in rings for place in places]
        of = np.repeat(np.arange(len(rings)), counts)
        ages = np.array([ring.age_s(now) for _, ring, _ in rings], np.float64)
        return cls(np.array(spots, np.float64).reshape(-1, 2), of, ages[of], counts)

    def seen(self, spots: NDArray[np.intp]) -> set[int]:
        """The rings of which all places are among these."""
        found = Counter(self.of[spots].tolist())
        return {ring for ring, count in found.items() if count == self.counts[ring]}


def beside(
    greenhouse: Greenhouse, x: float, y: float, seen_from: Pose2D
) -> Sequence[_Place]:
    """Where somebody may stand whose box lies in something that the plan draws.

    Boxes are off by 0.4 m; deeper in it the place is left as it is, where nobody looks.
    """
    most = LIMITS.uncertainty_m + _BODY_M
    places = list(_besides(greenhouse, x, y, seen_from))
    is_near = all(math.dist(one, (x, y)) <= most + 1e-9 for one in places)
    return places if places and is_near else [(x, y)]


def _besides(
    greenhouse: Greenhouse, x: float, y: float, seen_from: Pose2D
) -> Iterator[_Place]:
    """Places beside: nobody stands in a wall, and nobody sees through crop.

    So they are on the observer's side of that; over crates one sees, so it is each side
    that is near.
    """
    walls = greenhouse.bounds
    x = min(max(x, walls.xmin + _BODY_M), walls.xmax - _BODY_M)
    y = min(max(y, walls.ymin + _BODY_M), walls.ymax - _BODY_M)
    for row in greenhouse.rows:
        if row.contains(x, y):
            yield from [place for _, place in sorted(_sides(row, x, y, seen_from))[:1]]
            return
    for one in greenhouse.obstacles:
        if one.area.contains(x, y):
            sides = (place for _, place in _sides(one.area, x, y, None))
            yield from (place for place in sides if walls.contains(*place))
            return
    yield x, y


def _sides(
    area: Rectangle, x: float, y: float, seen_from: Pose2D | None
) -> list[tuple[float, tuple[float, float]]]:
    """Sides of an area that a place in it is near: how deep in it is, and beside it.

    Of those alone that are seen from somewhere, if that is given.
    """
    here = seen_from
    sides = [
        (x - area.xmin, (area.xmin - _BODY_M, y), here and here.x < area.xmin),
        (area.xmax - x, (area.xmax + _BODY_M, y), here and here.x > area.xmax),
        (y - area.ymin, (x, area.ymin - _BODY_M), here and here.y < area.ymin),
        (area.ymax - y, (x, area.ymax + _BODY_M), here and here.y > area.ymax),
    ]
    return [
        (deep, place)
        for deep, place, is_seen in sides
        if deep <= LIMITS.uncertainty_m and (here is None or is_seen)
    ]


def _hand_over(sighting: Sighting, people: People, now: Instant) -> None:
    """Whom lasers see where somebody may be by now is remembered as long as these."""
    until = sighting.at.mono + sighting.lasts_s
    reach = LIMITS.uncertainty_m + LIMITS.walking_m_s * sighting.age_s(now)
    for person in tuple(people.known.values()):
        for one in person.sightings:
            apart = math.dist((one.x, one.y), (sighting.x, sighting.y))
            if one.laser and apart <= reach and one.age_s(now) <= LIMITS.seen_s:
                people.exchange(person.person_id, one, one.remembered(until))


def _groups(
    rings: Sequence[tuple[TrackedPerson, Sighting]], people: People, now: Instant
) -> list[tuple[NDArray[np.bool_], Sequence[KnownBody]]]:
    """Rings of boxes, and those of looks and lasers, each with who explains returns.

    No look ends the ring of a box.
    """
    if not rings:
        return []
    seen = list(seen_sightings(people, now))
    guessed = np.array([ring.possible or ring.laser for _, ring in rings])
    bodies = [body for _, body in seen]
    sure = [body for one, body in seen if not one.possible]
    groups = (guessed, bodies), (~guessed, sure)
    return [(is_in, known) for is_in, known in groups if is_in.any()]


def seen_sightings(
    people: People, now: Instant
) -> Iterator[tuple[Sighting, KnownBody]]:
    """Who is seen now and has a ring, and where that explains returns of lasers."""
    for person in people.known.values():
        # Asked for each scan that is looked at: most people were seen long ago.
        newest = person.newest
        if now.mono - newest.at.mono > _YOUNG_S or newest.recording is not None:
            continue
        if people.things.known and people.things.explain(person, now) is not None:
            continue
        for one in person.sightings:
            age = one.age_s(now)
            if age <= _YOUNG_S and not one.reach_m:
                reach_m = _PERSON_M + LIMITS.walking_m_s * age
                yield one, KnownBody(one.x, one.y, reach_m)


def _may_go(sighting: Sighting, world: World, now: Instant) -> bool:
    """Whether a sighting is old enough, of a known place, and of a robot of today."""
    is_old = LIMITS.seen_s < sighting.age_s(now) <= LIMITS.ring_lasts_s
    is_placed = sighting.reach_m == 0.0
    return is_old and is_placed and not world.robot(sighting.observer).is_replay


def visible_from(
    robot: RobotState, spots: _Spots, greenhouse: Greenhouse, now: Instant
) -> NDArray[np.intp]:
    """The spots that a robot's camera has in view now, with nothing in between.

    Args:
        robot: One whose camera may be blind: then none.
        spots: Shape (n, 2), in ``map`` (m).
        greenhouse: What stands in between.
        now: This moment.
    """
    camera = _camera_of(robot, now) if len(spots) else None
    if camera is None:
        return _NONE
    profile = robot.profile
    dx, dy = spots[:, 0] - camera.x, spots[:, 1] - camera.y
    distance = np.hypot(dx, dy)
    bearing = np.arctan2(dy, dx) - camera.yaw
    off = np.abs((bearing + math.pi) % math.tau - math.pi)
    in_picture = np.flatnonzero(
        (distance >= _NEAR_M)
        & (distance <= _RANGE_SHARE * profile.camera_range)
        & (off <= profile.camera_fov / 2 - _EDGE_RAD)
    )
    clear = [
        one
        for one in in_picture.tolist()
        if greenhouse.in_sight(camera.x, camera.y, spots[one, 0], spots[one, 1])
    ]
    return np.array(clear, np.intp)


def is_detecting(robot: RobotState, now: Instant) -> bool:
    """Whether a robot's camera works and its place is known."""
    return _camera_of(robot, now) is not None


def _camera_of(robot: RobotState, now: Instant) -> Pose2D | None:
    """Pose of a robot's camera, if it works now and its place is certain.

    Who contradicts itself, however shortly, finds no spot empty, nor does a frame that
    was not read whole.
    """
    if robot.doubts.is_open(now) or robot.detector.is_flawed(now):
        return None
    age, looked = robot.age_s(now), robot.detections_at
    if robot.odometry is None or looked is None:
        return None
    if age is None or age > LIMITS.live_s:
        return None
    if now.mono - looked > _FRESH_LOOK_S:
        return None
    return robot.odometry.pose.compose(robot.profile.camera)
