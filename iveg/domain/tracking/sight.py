"""Lines of sight: cameras, crop, and the all-clear of an empty spot.

A ring goes by time or because a robot has had its centre in view for a second and found
nobody, not even faintly; never for one missing frame (docs/safety.md, "Age").  What a
camera does not look at a laser may have swept (``laser_sight``).
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.people import People
from iveg.domain.tracking.person import Sighting, TrackedPerson
from iveg.domain.world import World

CLEAR_S = 1.0
_EDGE_RAD = math.radians(5.0)
"""So far inside the picture that a person there would be seen whole."""
_NEAR_M, _RANGE_SHARE = 1.0, 0.75
_FRESH_LOOK_S = 0.5

_Look = tuple[int, str]
_Spots = NDArray[np.float64]
_NONE = np.empty(0, np.intp)
Swept = Callable[[RobotState, _Spots, NDArray[np.float64], Instant], NDArray[np.intp]]
"""Robot, spots, ages of their sightings (s), now → the spots that its newest scan
shows to be empty."""


class AllClear:
    """Takes old sightings away once their place was seen to be empty.

    Args:
        swept: Asks a robot's laser; nobody's counts if left out.
    """

    def __init__(self, swept: Swept = lambda *_: _NONE) -> None:
        self._swept = swept
        self._since: dict[_Look, float] = {}

    def sweep(
        self, people: People, world: World, greenhouse: Greenhouse, now: Instant
    ) -> list[TrackedPerson]:
        """Remove rings whose centre is seen to be empty; returns their persons."""
        watched: dict[_Look, float] = {}
        empty: set[int] = set()
        rings = [
            (person, sighting)
            for person in people.known.values()
            for sighting in person.sightings
            if _may_go(sighting, world, now)
        ]
        spots = np.array([(ring.x, ring.y) for _, ring in rings]).reshape(-1, 2)
        ages = np.array([ring.age_s(now) for _, ring in rings])
        for robot in world.live_robots() if rings else ():
            seen = visible_from(robot, spots, greenhouse, now)
            swept = self._swept(robot, spots, ages, now)
            for index in np.union1d(seen, swept).tolist():
                person, sighting = rings[index]
                if people.is_suspected(person, sighting, robot.robot_id):
                    continue
                pair = sighting.chain, robot.robot_id
                watched[pair] = self._since.get(pair, now.mono)
                if now.mono - watched[pair] >= CLEAR_S:
                    empty.add(index)
        self._since = watched
        return [
            people.drop_sighting(person.person_id, sighting)
            for person, sighting in (rings[index] for index in sorted(empty))
        ]


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
