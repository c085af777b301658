"""Whom a camera lost, while the laser of the same robot has them in sight.

The ring of an old sighting takes in wherever somebody may have walked to by now.  Where
the robot stays beside them its laser sees where they are, so once it has for a second
the ring is about that place: as wide as of somebody whom nobody has seen for a second,
and growing like any other as soon as the laser loses them.  Nothing else changes: who
it is, how long they are remembered, and what ends the ring.

It has to be plain at each sweep who that is.  The camera saw somebody just now, and
within a metre of there the laser of the same robot, which sees from the same place, has
one lone body of a person's size.  From sweep to sweep nobody can go so far that another
one might stand there by then.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Followed, Sighting, TrackedPerson
from iveg.domain.world import World

_WATCHED_S = 1.0
"""So long somebody is in sight of a laser before their ring moves."""
_BEGINS_S, _BOX_M = 0.5, 0.6
"""So soon after a box, and so near to it: half of a person, and the error of a box."""
_GAP_S, _STEP_M, _ALONE_M = 0.25, 0.3, 1.1
"""Between two sweeps at most; how far returns may be from a middle; how far everything
else is.  In that time nobody walks from there to where another one may be by then."""
_LEAST_M, _MOST_M = 0.15, 0.7
"""Less may be a plant's tip beside which somebody is taken for the plants; two people
beside each other are larger."""
_LEAST_RETURNS = 3
_NEAREST_M, _FARTHEST_M = 0.5, 8.0
"""From the laser: a part of the robot; beyond, too few beams meet somebody."""
_DEEP_M = 0.2
"""Behind what a laser sees of somebody is their middle."""
_PEER_M = 1.5
"""So near to a peer one may be taken for the other."""
_OTHER_M = 1.6
"""From where a camera saw two people they could be taken for each other."""


@dataclass(frozen=True, slots=True, eq=False)
class Returns:
    """What a scan that may be believed shows, and no plan explains.

    Attributes:
        at: When it came (monotonic, s).
        sensor: Where it was made, in ``map``.
        points: Shape (n, 2), in ``map`` (m).
    """

    at: float
    sensor: Pose2D
    points: NDArray[np.float64]


Unexplained = Callable[[RobotState, Instant], Returns | None]
"""Asks a robot's newest scan; None: of too many, or it may be wrong itself."""


_Seen = tuple[TrackedPerson, Sighting]


@dataclass(frozen=True, slots=True)
class _Watched:
    """Somebody whom a laser has in sight.

    Attributes:
        seen: When the camera saw them; ``since`` when the laser did first, of its
            sweeps without a gap (monotonic, s).
    """

    seen: float
    since: float
    place: Followed


class Following:
    """Moves the rings of those whom lasers follow.

    Args:
        unexplained: Asks a robot's laser.
    """

    def __init__(self, unexplained: Unexplained) -> None:
        self._unexplained = unexplained
        self._watched: dict[int, _Watched] = {}
        """By chain."""

    def tick(self, people: People, world: World, now: Instant) -> None:
        """Look at the newest scan of each robot that saw somebody."""
        before, self._watched = self._watched, {}
        for observer, seen in _seen_by_cameras(people, now).items():
            robot = world.robot(observer)
            for person, one in seen:
                known = before.get(one.chain)
                if known is not None and known.seen != one.at.mono:
                    known = None
                found = self._found(known, (person, one), seen, robot, now)
                if found is None or _is_near_peer(found.place, robot, world):
                    continue
                self._watched[one.chain] = found
                if found is not known and found.place.at - found.since >= _WATCHED_S:
                    moved = one.followed_to(found.place)
                    people.exchange(person.person_id, one, moved)

    def _found(
        self,
        known: _Watched | None,
        whom: _Seen,
        seen: Sequence[_Seen],
        robot: RobotState,
        now: Instant,
    ) -> _Watched | None:
        """Somebody in the newest sweep of the robot that saw them, and others."""
        since = whom[1].at.mono if known is None else known.place.at
        if now.mono - since > _BEGINS_S:
            return None
        returns = self._unexplained(robot, now)
        if returns is None or returns.at <= since:
            return known
        if known is not None:
            return _gone_on(known, returns)
        return None if _are_two(whom, seen, now) else _begun(whom[1], returns)


def _seen_by_cameras(people: People, now: Instant) -> Mapping[str, Sequence[_Seen]]:
    """By camera, the people whom it saw, by each of their sightings with a ring."""
    found = defaultdict[str, list[_Seen]](list)
    for person in people.known.values():
        if person.class_ != "person":
            continue
        for one in person.sightings:
            is_placed = one.reach_m == 0.0 and one.chain > 0 and one.recording is None
            if is_placed and not one.laser and one.age_s(now) <= one.lasts_s:
                found[one.observer].append((person, one))
    return found


def _are_two(whom: _Seen, seen: Iterable[_Seen], now: Instant) -> bool:
    """Whether its robot sees another one so near that they could be confused."""
    person, one = whom
    return any(
        they is not person
        and other.age_s(now) <= LIMITS.seen_s
        and math.dist((one.x, one.y), (other.x, other.y)) <= _OTHER_M
        for they, other in seen
    )


def _begun(one: Sighting, returns: Returns) -> _Watched | None:
    """Whom a laser has where a camera saw them just now."""
    reach = _BOX_M + LIMITS.walking_m_s * (returns.at - one.at.mono)
    place = lone_body(returns, one.x, one.y, reach)
    return None if place is None else _Watched(one.at.mono, returns.at, place)


def _gone_on(known: _Watched, returns: Returns) -> _Watched | None:
    """The same one in the next sweep."""
    before, after_s = known.place, returns.at - known.place.at
    if after_s > _GAP_S:
        return None
    reach = _STEP_M + LIMITS.walking_m_s * after_s
    place = lone_body(returns, before.x, before.y, reach)
    return None if place is None else replace(known, place=place)


def lone_body(returns: Returns, x: float, y: float, reach_m: float) -> Followed | None:
    """The one body within reach of a place, with nothing unexplained beside it."""
    points, sensor = returns.points, returns.sensor
    near = np.hypot(points[:, 0] - x, points[:, 1] - y) <= reach_m
    if np.count_nonzero(near) < _LEAST_RETURNS:
        return None
    middle = points[near].mean(0)
    about = np.hypot(*(points - middle).T) <= _ALONE_M
    size = float(np.hypot(*np.ptp(points[about | near], axis=0)))
    away = math.dist((sensor.x, sensor.y), middle.tolist())
    if not (_LEAST_M <= size <= _MOST_M and _NEAREST_M <= away <= _FARTHEST_M):
        return None
    east, north = (middle - (sensor.x, sensor.y)) * (1.0 + _DEEP_M / away)
    return Followed(sensor.x + float(east), sensor.y + float(north), returns.at)


def _is_near_peer(place: Followed, robot: RobotState, world: World) -> bool:
    return any(
        one is not robot
        and one.odometry is not None
        and one.odometry.pose.distance_to(place.x, place.y) <= _PEER_M
        for one in world.robots.values()
    )
