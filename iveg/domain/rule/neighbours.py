"""Who may come near whom within half a second (Verlet's neighbour list).

Everybody is compared with everybody as arrays, with room for how far all may go in half
a second; until then, or until somebody appears or goes farther, only what was within
reach is looked at.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.observations import Instant, Odometry
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import TrackedPerson
from iveg.domain.world import World

_Floats = NDArray[np.float64]
NOT_FAR_M = 0.01
"""So far outside a ring nobody can be inside, whatever rounding does."""
_ROOM_M, _HOLDS_S = 0.5, 0.5
"""So far anybody may go, and so much older get, before all are compared again."""
_Place = tuple[float, float, float]
"""Of a robot: x, y (m), and the moment of its pose (monotonic, s)."""


@dataclass(frozen=True, slots=True)
class Neighbours:
    """Pairs that may come near each other within half a second.

    Attributes:
        at: When all were compared (monotonic, s).
        places: Places of the robots then; ``persons`` likewise.
        causes: Robot → people, then robots, in their order.
        checked: The newest odometry and the newest of each person that are still
            within reach of that, so that nobody is compared twice.
    """

    at: float
    radius_m: float
    places: Mapping[str, _Place]
    persons: Mapping[str, TrackedPerson]
    causes: Mapping[str, Mapping[str, None]]
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
        robots = np.array(list(places.values())).reshape(-1, 3).T
        names = list(places)
        seen = [
            (person.person_id, look)
            for person in people.known.values()
            for look in person.sightings
        ]
        spots = [(look.x, look.y, look.at.mono, look.reach_m) for _, look in seen]
        x, y, since, reach = np.array(spots).reshape(-1, 4).T
        near = dict[str, dict[str, None]]()
        age, limit = _reach(rule, now, since, reach)
        limit[age > LIMITS.ring_lasts_s] = -1.0
        for row, column in _within(robots, x, y, limit):
            near.setdefault(names[row], {})[seen[column][0]] = None
        x, y, since = robots
        # A peer that has long been silent may speak again.
        for row, column in _within(robots, x, y, _reach(rule, now, since)[1]):
            # A robot is near itself, which does not slow it.
            if row != column:
                near.setdefault(names[row], {})[names[column]] = None
        persons = dict(people.known)
        return cls(now.mono, rule.radius_m, places, persons, near, {**persons})

    def hold(
        self, world: World, people: People, rule: DetectionRule, now: Instant
    ) -> bool:
        """Whether nobody else can be near anybody by now."""
        return (
            0.0 <= now.mono - self.at <= _HOLDS_S
            and rule.radius_m == self.radius_m
            and all(
                self._is_still_there(robot)
                for robot in world.robots.values()
                # Its moment is known or estimated once, as it comes.
                if self.checked.get(robot.robot_id) is not robot.odometry
            )
            and all(
                self._is_still_seen_there(person)
                for name, person in people.known.items()
                if self.checked.get(name) is not person
            )
        )

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
        before = self.persons.get(person.person_id)
        if before is None:
            return False
        spots = [
            (one.x, one.y, one.at.mono, one.reach_m)
            for one in before.sightings
            if self.at - one.at.mono <= LIMITS.ring_lasts_s
        ]
        for look in person.sightings:
            here = look.x, look.y, look.at.mono
            if not any(
                _is_as_near(here, spot[:3]) and look.reach_m <= spot[3]
                for spot in spots
            ):
                return False
        self.checked[person.person_id] = person
        return True


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


def _reach(
    rule: DetectionRule, now: Instant, since: _Floats, reach: _Floats | float = 0.0
) -> tuple[_Floats, _Floats]:
    """Ages (s), and how near a robot must be to come into such a ring soon (m)."""
    age: _Floats = np.maximum(0.0, now.mono - since)
    ring = ring_radius(rule.radius_m, age + _HOLDS_S, np.minimum, np.maximum)
    return age, np.maximum(reach, ring) + 2 * _ROOM_M + 2 * NOT_FAR_M


def _within(
    robots: _Floats, x: _Floats, y: _Floats, limit: _Floats
) -> Iterator[tuple[int, int]]:
    """Which robots (columns of x, y, …) are within ``limit`` (m) of which places."""
    dx, dy = x - robots[0][:, None], y - robots[1][:, None]
    rows, columns = np.nonzero((dx * dx + dy * dy <= limit * limit) & (limit > 0.0))
    return zip(rows.tolist(), columns.tolist(), strict=True)
