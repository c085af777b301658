"""Spots that a laser finds empty: every beam towards them ends well behind them.

A camera looks ahead; a laser looks to the sides and behind as well, so a place that was
left beside a robot need not be remembered as somebody's until time ends it.

A sweep proves nothing where it may be wrong itself.  Beams that do not come back say
nothing (a covered laser sees "nothing" everywhere), and a laser that repeats itself is
frozen.  Most of the returns must be explained by the plan of the greenhouse: a laser
that is turned on its mount, or of a robot at a wrong pose, draws walls where none are.
Nothing unexplained may stand so near that the person may have walked there, but who has
a ring there by now.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant, LaserScan
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.following import Returns
from iveg.domain.tracking.sight import AllClear
from iveg.domain.witness import PLAN_M, KnownBody, Plan

ScanOf = Callable[[RobotState], LaserScan | None]
"""Reads a robot's newest scan; None where there is none that can be read."""
_Floats = NDArray[np.float64]
Strange = Callable[[LaserScan, Pose2D], _Floats | None]
"""Returns of a scan made at a pose that nothing explains; None: of too many."""
_Bearing = TypeVar("_Bearing", float, NDArray[np.float64])
_NONE = np.empty(0, np.intp)
_FRESH_S = 0.5
_NEAREST_M, _FARTHEST_M = 0.5, 12.0
"""A spot under the robot is not in view; beyond, beams are too far apart."""
_BESIDE_M, _BEHIND_M = 0.3, 0.2
"""Half of a person and the error of a pose: so wide, and so far behind."""
_LEAST_BEAMS = 3
EXPLAINED = 0.7
"""Share of the returns that a plan explains to a laser that works."""
_WALKED_MOST_M = LIMITS.ring_most_m
"""Beyond, no ring of theirs would cover them."""


class LaserSight:
    """What lasers find empty, by the newest scan of a robot that may be believed.

    Args:
        plan: What stands in the greenhouse.
        newest: Reads a robot's newest scan.
    """

    def __init__(self, plan: Plan, newest: ScanOf) -> None:
        self._plan = plan
        self._newest = newest
        self._scans: dict[str, tuple[LaserScan, bool]] = {}
        """By robot the newest scan that was asked for, and whether it is frozen."""
        self._strange: dict[str, tuple[LaserScan, Pose2D, _Floats | None]] = {}
        """By robot a scan, where it was made, and what the plan leaves of it."""

    def all_clear(self) -> AllClear:
        """What asks it of old rings."""
        return AllClear(self.swept, self.returns)

    def swept(
        self,
        robot: RobotState,
        spots: _Floats,
        ages: _Floats,
        bodies: Sequence[KnownBody],
        now: Instant,
    ) -> NDArray[np.intp]:
        """``sight.Swept``; none by a scan that is old or makes no sense."""
        pose = robot.scan_pose
        if pose is None or not _is_believed(robot, now):
            return _NONE
        if not np.any(np.hypot(*(spots - (pose.x, pose.y)).T) <= _FARTHEST_M):
            return _NONE
        scan = self._moving(robot)
        if scan is None:
            return _NONE
        return swept_by(scan, pose, spots, ages, self._strange_of, bodies)

    def returns(self, robot: RobotState, now: Instant) -> Returns | None:
        """``following.Unexplained``; none of a scan that is old or makes no sense."""
        pose, received = robot.scan_pose, robot.scan_received
        if pose is None or received is None or not _is_believed(robot, now):
            return None
        scan = self._moving(robot)
        strange = None if scan is None else self._strange_of(scan, pose)
        if scan is None or strange is None:
            return None
        return Returns(received.mono, pose.compose(scan.mount), strange)

    def _strange_of(self, scan: LaserScan, pose: Pose2D) -> _Floats | None:
        """``unexplained``, once for all rings and ticks that ask the same scan."""
        before = self._strange.get(scan.robot_id)
        if before is None or before[0] is not scan or before[1] != pose:
            before = scan, pose, unexplained(scan, pose, self._plan)
            self._strange[scan.robot_id] = before
        return before[2]

    def _moving(self, robot: RobotState) -> LaserScan | None:
        """A robot's newest scan; None of a laser that is frozen."""
        scan = self._newest(robot)
        return None if scan is None or self._is_frozen(scan) else scan

    def _is_frozen(self, scan: LaserScan) -> bool:
        """Whether a scan repeats the one before to the bit: no laser is so exact."""
        before, frozen = self._scans.get(scan.robot_id, (None, False))
        if before is not scan:
            frozen = before is not None and np.array_equal(before.ranges, scan.ranges)
            self._scans[scan.robot_id] = scan, frozen
        return frozen


def swept_by(
    scan: LaserScan,
    pose: Pose2D,
    spots: _Floats,
    ages: _Floats,
    strange_of: Strange,
    bodies: Iterable[KnownBody] = (),
) -> NDArray[np.intp]:
    """The spots that a scan shows to be empty.

    Args:
        scan: Made at ``pose`` in ``map``.
        pose: Of the robot's ``base_link``.
        spots: Shape (n, 2), in ``map`` (m).
        ages: Shape (n,): how long ago somebody stood there (s).
        strange_of: What the plan leaves of the scan, asked where any spot is seen past.
        bodies: Who is seen by now and has a ring: whoever walked there is one of them.
    """
    passed = _passed(scan, pose, spots)
    strange = strange_of(scan, pose) if passed else None
    return _NONE if strange is None else _empty(passed, strange, spots, ages, bodies)


def _passed(scan: LaserScan, pose: Pose2D, spots: _Floats) -> list[int]:
    """The spots that a laser sees past."""
    sensor = pose.compose(scan.mount)
    return [
        index
        for index in _perhaps_passed(scan, sensor, spots).tolist()
        if passes_by(scan, sensor, *spots[index].tolist())
    ]


def unexplained(scan: LaserScan, pose: Pose2D, plan: Plan) -> _Floats | None:
    """Returns that the plan does not explain, in ``map`` (m); None: of too many."""
    points = scan.points(pose).astype(np.float64)
    strange = points[plan.distance_to(points[:, 0], points[:, 1]) > PLAN_M]
    is_fit = len(strange) <= (1.0 - EXPLAINED) * len(points)
    return strange if is_fit else None


def _empty(
    passed: list[int],
    strange: _Floats,
    spots: _Floats,
    ages: _Floats,
    bodies: Iterable[KnownBody],
) -> NDArray[np.intp]:
    """Those of the spots that are seen past where nobody may have walked from."""
    for one in bodies:
        away = np.hypot(strange[:, 0] - one.x, strange[:, 1] - one.y)
        strange = strange[away > one.radius]
    walked = np.minimum(_WALKED_MOST_M, _BESIDE_M + LIMITS.walking_m_s * ages[passed])
    apart = np.hypot(*(strange[:, None] - spots[passed]).transpose(2, 0, 1))
    empty: NDArray[np.intp] = np.array(passed)[np.all(apart > walked, axis=0)]
    return empty


def _perhaps_passed(
    scan: LaserScan, sensor: Pose2D, spots: _Floats
) -> NDArray[np.intp]:
    """The spots behind which the beam to their middle ends; few are looked at whole."""
    if not scan.angle_increment:
        return _NONE
    dx, dy = spots[:, 0] - sensor.x, spots[:, 1] - sensor.y
    away = np.hypot(dx, dy)
    beams = np.rint(_beams(scan, np.arctan2(dy, dx) - sensor.yaw)).astype(np.intp)
    hits = scan.ranges[beams % scan.ranges.size]
    return np.flatnonzero((hits >= away + _BEHIND_M) & (away <= _FARTHEST_M))


def passes_by(scan: LaserScan, sensor: Pose2D, x: float, y: float) -> bool:
    """Whether all beams that a person at a spot would stop end behind it."""
    dx, dy = x - sensor.x, y - sensor.y
    away, step = math.hypot(dx, dy), abs(scan.angle_increment)
    if not _NEAREST_M <= away <= _FARTHEST_M or not step:
        return False
    towards = _beams(scan, math.atan2(dy, dx) - sensor.yaw)
    half = math.atan2(_BESIDE_M, away) / step
    first, last = math.ceil(towards - half), math.floor(towards + half)
    count, in_turn = last + 1 - first, scan.ranges.size
    if not _LEAST_BEAMS <= count <= in_turn:
        return False
    beams = np.arange(first, last + 1)
    if in_turn > math.tau / step - 0.5:
        beams %= in_turn
    # The sweep may end where a person begins.
    elif first < 0 or last >= in_turn:
        return False
    hits = scan.ranges[beams]
    passes = (hits >= away + _BEHIND_M) & (hits <= scan.range_max)
    return bool(passes.all())


def _beams(scan: LaserScan, bearing: _Bearing) -> _Bearing:
    """Which beam goes at a bearing in the sensor's frame, counted from the first."""
    turn = math.tau / abs(scan.angle_increment)
    return ((bearing - scan.angle_min) / scan.angle_increment) % turn


def _is_believed(robot: RobotState, now: Instant) -> bool:
    """Whether a robot's scan is fresh, and its pose is not in doubt."""
    scanned, age = robot.scan_received, robot.age_s(now)
    if scanned is None or age is None or robot.doubts.is_open(now):
        return False
    return age <= LIMITS.live_s and now.mono - scanned.mono <= _FRESH_S
