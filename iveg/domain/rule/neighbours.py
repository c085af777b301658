"""Who may come near whom within half a second (Verlet's neighbour list).

Everybody is compared with everybody as arrays, with room for how far all may go in half
a second; until then, or until a robot appears or goes farther, only what was within
reach is looked at.  Whoever else appears or goes farther is compared anew alone.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.observations import Instant, Odometry
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.world import World

_Floats = NDArray[np.float64]
NOT_FAR_M = 0.01
"""So far outside a ring nobody can be inside, whatever rounding does."""
_ROOM_M, _HOLDS_S = 0.5, 0.5
"""So far anybody may go, and so much older get, before they are compared again."""
_Place = tuple[float, float, float]
"""Of a robot: x, y (m), and the moment of its pose (monotonic, s)."""
_Spot = tuple[float, float, float, float]
"""Of a ring: middle (m), since when it grows (s), how wide it is at least (m)."""


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Pairs that may come near each other within half a second.

    Attributes:
        at: When all robots were compared (monotonic, s).
        places: Places of the robots then.
        peers: Robot → robots, in their order.
        causes: Robot → people, then robots, in their order.
        spots: Rings of each person as they were compared.
        checked: The newest odometry and the newest of each person that are still
            within reach of that, so that nobody is compared twice.
    """

    at: float
    radius_m: float
    places: Mapping[str, _Place]
    peers: Mapping[str, Sequence[str]]
    causes: dict[str, Mapping[str, None]]
    spots: dict[str, Sequence[_Spot]]
    checked: dict[str, Odometry | TrackedPerson]

    @classmethod
    def of(
        cls, world: World, people: People, rule: DetectionRule, now: Instant
    ) -> "Neighbours":
        """Compare everybody with everybody."""
        places = {
            robot.robot_id: place
            for robot in world.robots.values()
            if (place := _place_of(robot)) is not None
        }
        peers, names = defaultdict[str, list[str]](list), list(places)
        x, y, since = robots = _columns(places)
        # A peer that has long been silent may speak again.
        for row, column in _within(robots, x, y, _reach(rule, now, since)):
            # A robot is near itself, which does not slow it.
            if row != column:
                peers[names[row]].append(names[column])
        causes: dict[str, Mapping[str, None]] = {
            name: dict.fromkeys(mine) for name, mine in peers.items()
        }
        known = cls(now.mono, rule.radius_m, places, peers, causes, {}, {})
        known.follow(people, rule, now)
        return known

    def hold(self, world: World, rule: DetectionRule, now: Instant) -> bool:
        """Whether all robots are still where they were compared, nearly."""
        return (
            0.0 <= now.mono - self.at <= _HOLDS_S
            and rule.radius_m == self.radius_m
            and all(
                self._is_still_there(robot)
                for robot in world.robots.values()
                # Its moment is known or estimated once, as it comes.
                if self.checked.get(robot.robot_id) is not robot.odometry
            )
        )

    def follow(self, people: People, rule: DetectionRule, now: Instant) -> None:
        """Compare whoever appeared, or went too far, with where the robots were.

        There is as much room as if all were compared now: the robots went half a metre
        since, at most, and these hold for half a second from now, at most.
        """
        checked = self.checked
        # Asked at each judgement: nearly all are checked.
        moved = {
            name: one
            for name, one in people.known.items()
            if checked.get(name) is not one and not self._is_still_seen_there(one)
        }
        if not moved:
            return
        near = self._near(moved, rule, now)
        for robot in self.places:
            mine, theirs = self.causes.get(robot, {}), near[robot]
            if mine.keys() & moved.keys() != theirs:
                left = (mine.keys() - moved.keys() | theirs) & people.known.keys()
                # In the order of their appearance, as all are known.
                here = sorted(left, key=lambda name: people.known[name].number)
                others = self.peers.get(robot, ())
                self.causes[robot] = dict.fromkeys((*here, *others))

    def _near(
        self, moved: Mapping[str, TrackedPerson], rule: DetectionRule, now: Instant
    ) -> Mapping[str, set[str]]:
        """Who of these is near each robot; notes where they were compared."""
        self.checked.update(moved)
        of, spots = list[str](), list[_Spot]()
        for name, person in moved.items():
            rings = self.spots[name] = [
                _spot_of(one)
                for one in person.sightings
                if now.mono - one.at.mono <= LIMITS.ring_lasts_s
            ]
            of += [name] * len(rings)
            spots += rings
        x, y, since, reach = np.array(spots).reshape(-1, 4).T
        names, near = list(self.places), defaultdict[str, set[str]](set)
        limit = _reach(rule, now, since, reach)
        for row, column in _within(_columns(self.places), x, y, limit):
            near[names[row]].add(of[column])
        return near

    def _is_still_there(self, robot: RobotState) -> bool:
        odometry, name = robot.odometry, robot.robot_id
        if odometry is None:
            return True
        place, now = self.places.get(name), _place_of(robot)
        if place is None or now is None or not _is_as_near(now, place):
            return False
        self.checked[name] = odometry
        return True

    def _is_still_seen_there(self, person: TrackedPerson) -> bool:
        spots = self.spots.get(person.person_id)
        if spots is None:
            return False
        for look in person.sightings:
            here = _spot_of(look)[:3]
            if not any(
                _is_as_near(here, spot[:3]) and look.reach_m <= spot[3]
                for spot in spots
            ):
                return False
        self.checked[person.person_id] = person
        return True


def _spot_of(look: Sighting) -> _Spot:
    return *look.place, look.at.mono, look.reach_m


def _place_of(robot: RobotState) -> _Place | None:
    """The place of a robot; None where it is unknown."""
    since = robot.likely_pose_at()
    if robot.odometry is None or since is None:
        return None
    return robot.odometry.pose.x, robot.odometry.pose.y, since


def _is_as_near(now: _Place, before: _Place) -> bool:
    """Whether something is not far from where it was, and not older than that."""
    dx, dy = now[0] - before[0], now[1] - before[1]
    return dx * dx + dy * dy <= _ROOM_M * _ROOM_M and now[2] >= before[2]


def _columns(places: Mapping[str, _Place]) -> _Floats:
    """Places of robots, x and y (m), and the moments of their poses (monotonic, s)."""
    return np.array(list(places.values())).reshape(-1, 3).T


def _reach(
    rule: DetectionRule, now: Instant, since: _Floats, reach: _Floats | float = 0.0
) -> _Floats:
    """How near a robot must be to come into such a ring soon (m)."""
    age = np.maximum(0.0, now.mono - since)
    ring = ring_radius(rule.radius_m, age + _HOLDS_S, np.minimum, np.maximum)
    limit: _Floats = np.maximum(reach, ring) + 2 * _ROOM_M + 2 * NOT_FAR_M
    return limit


def _within(
    robots: _Floats, x: _Floats, y: _Floats, limit: _Floats
) -> Iterator[tuple[int, int]]:
    """Which robots (columns of x, y, …) are within ``limit`` (m) of which places."""
    dx, dy = x - robots[0][:, None], y - robots[1][:, None]
    rows, columns = np.nonzero(dx * dx + dy * dy <= limit * limit)
    return zip(rows.tolist(), columns.tolist(), strict=True)
