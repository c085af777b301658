"""From ROS messages to domain values; values out of range are refused.

Each message is interpreted by one function.  Numbers that are not finite raise
``UnreadableError`` with a short, stable reason, by which errors are counted.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError
from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.geometry import Box3D, Twist2D
from iveg.domain.observations import (
    UNKNOWN_ORIGIN,
    Detection,
    LaserScan,
    Navigation,
    RobotFault,
)
from iveg.domain.wire import FORBIDDEN, MAX_BEAMS, MAX_PATH, clean_text
from iveg.robot.grounding import corners_of, hull_of
from iveg.robot.ros2.transforms import RigidTransform, rigid_of
from iveg.ros2 import messages as ros

FASTEST_M_S = 20.0
"""Speed above which a value is refused: no vehicle in crop rows is so fast (m/s)."""
_FARTHEST_M = 1e6
_NOTHING, _UNKNOWN = np.float32(np.inf), np.float32(0.0)
"""Ranges without a return, and without a measurement (below every valid range)."""
_LEAST_RANGE_M = 1e-3
_FINEST_RAD = 1e-4
"""Angle between beams below which a scan is refused: no laser is finer."""
_TILT = math.radians(10.0)
_LONGEST_RANGE_M = 1e4
_FORBIDDEN = str.maketrans(dict.fromkeys(FORBIDDEN))


def read_pose(odometry: ros.Odometry) -> RigidTransform:
    """Pose of the robot in the odometry frame.

    Raises:
        UnreadableError: ``not_a_number``.
    """
    pose = odometry.pose.pose
    rigid = rigid_of(pose.position, pose.orientation)
    if rigid is None or max(map(abs, rigid.move)) > _FARTHEST_M:
        raise UnreadableError("not_a_number", "a pose")
    return rigid


def read_twist(twist: ros.Twist) -> Twist2D:
    """Forward speed and yaw rate; the other components do not apply to wheels.

    Raises:
        UnreadableError: ``not_a_number``, or ``absurd`` above 20 m/s or rad/s.
    """
    forward, turn = twist.linear.x, twist.angular.z
    if not (math.isfinite(forward) and math.isfinite(turn)):
        raise UnreadableError("not_a_number", "a twist")
    if max(abs(forward), abs(turn)) > FASTEST_M_S:
        raise UnreadableError("absurd", f"{forward:g} m/s, {turn:g} rad/s")
    return Twist2D(forward, turn)


def write_twist(twist: Twist2D) -> ros.Twist:
    """Inverse of ``read_twist``."""
    return ros.Twist(ros.Vector3(twist.linear_x), ros.Vector3(z=twist.angular_z))


def read_scan(scan: ros.LaserScan, laser: RigidTransform) -> LaserScan:
    """A scan of a laser that is mounted level, upright or upside down.

    Args:
        scan: As it came.
        laser: Pose of the laser in ``base_link``.

    Raises:
        UnreadableError: ``too_many_beams`` (above 4,096),
            ``not_a_number``, ``bad_range``, ``tilted_laser``, ``no_returns``.
    """
    count = scan.ranges.size
    if count > MAX_BEAMS:
        raise UnreadableError("too_many_beams", f"{count}")
    numbers = scan.angle_min, scan.angle_increment, scan.range_min
    if not all(math.isfinite(number) and abs(number) <= 1e4 for number in numbers):
        raise UnreadableError("not_a_number", "a sweep")
    turns = abs(scan.angle_increment) >= _FINEST_RAD
    if not turns or not max(0.0, scan.range_min) < scan.range_max:
        raise UnreadableError("bad_range", f"{scan.range_max}")
    side = _side(laser)
    read = LaserScan(
        "",
        UNKNOWN_ORIGIN,
        scan.angle_min * side,
        scan.angle_increment * side,
        # Above 0, which stands for no measurement.
        max(_LEAST_RANGE_M, scan.range_min),
        min(scan.range_max, _LONGEST_RANGE_M),
        laser.flat(),
        _ranges(scan),
    )
    if not read.returns().any():
        raise UnreadableError("no_returns")
    return read


def _ranges(scan: ros.LaserScan) -> NDArray[np.float32]:
    """Ranges as a measure has them (REP-117).

    Only +inf says that nothing came back.  NaN is no measurement and -inf is too near
    for one: neither shows that the way is free.
    """
    ranges: NDArray[np.float32] = scan.ranges.copy()
    # Comparisons with NaN are false.
    odd = ~((ranges > 0.0) & (ranges <= _FARTHEST_M))
    ranges[odd] = np.where(ranges[odd] > 0.0, _NOTHING, _UNKNOWN)
    return ranges


def _side(laser: RigidTransform) -> int:
    """Direction of growing angles seen from above."""
    if laser.tilt <= _TILT:
        return 1
    if laser.tilt >= math.pi - _TILT:
        return -1
    raise UnreadableError("tilted_laser", f"{math.degrees(laser.tilt):.0f}°")


def read_detection(detection: ros.Detection3D, place: RigidTransform) -> Detection:
    """A box in ``map``: the hull of the rotated one.

    Args:
        detection: As it came.
        place: Pose of its frame in ``map``.

    Raises:
        UnreadableError: ``no_class``, ``bad_probability``, ``not_a_number``.
    """
    class_id, probability = read_hypothesis(detection.results)
    centre, size = detection.bbox.center, detection.bbox.size
    box = rigid_of(centre.position, centre.orientation)
    sides = size.x, size.y, size.z
    if box is None or not all(0.0 <= side < math.inf for side in sides):
        raise UnreadableError("not_a_number", "a box")
    x, y, z = (side / 2 for side in sides)
    corners = corners_of(Box3D(-x, x, -y, y, -z, z))
    hull = within_world(hull_of(place.compose(box).apply(corners)))
    det_id = clean(detection.id) or None
    return Detection(class_id, probability, hull, "map", det_id)


def read_hypothesis(
    results: Sequence[ros.ObjectHypothesisWithPose],
) -> tuple[str, float]:
    """Class and score of the most probable hypothesis.

    Raises:
        UnreadableError: ``no_class`` or ``bad_probability``.
    """
    if not results:
        raise UnreadableError("no_class", "a detection without a hypothesis")
    best = max((result.hypothesis for result in results), key=_score)
    if not 0.0 <= best.score <= 1.0:
        raise UnreadableError("bad_probability", f"{best.score}")
    name = clean(best.class_id)
    if not name:
        raise UnreadableError("no_class", "a class without a name")
    return name, best.score


def class_id_of(results: Sequence[ros.ObjectHypothesisWithPose]) -> str | None:
    """The only class that a detection may be of; None where it may be another."""
    if len(results) != 1:
        return None
    try:
        return read_hypothesis(results)[0]
    except UnreadableError:
        return None


def _score(hypothesis: ros.ObjectHypothesis) -> float:
    return -1.0 if math.isnan(hypothesis.score) else hypothesis.score


def within_world(box: Box3D) -> Box3D:
    """Check that a box lies within the world, and return it.

    Raises:
        UnreadableError: ``absurd``: not a number, or too far away.
    """
    most = _FARTHEST_M
    # Comparisons with NaN are false.
    if (
        -most <= box.xmin <= box.xmax <= most
        and -most <= box.ymin <= box.ymax <= most
        and -most <= box.zmin <= box.zmax <= most
    ):
        return box
    raise UnreadableError("absurd", "a box outside of the world")


def read_path(path: ros.Path, place: RigidTransform) -> Navigation:
    """The path in ``map``; a long one is thinned to 1,024 points.

    Raises:
        UnreadableError: ``not_a_number``.
    """
    stride = max(1, math.ceil(len(path.poses) / (MAX_PATH - 1)))
    poses = [*path.poses[:-1:stride], *path.poses[-1:]]
    points = np.array([(p.pose.position.x, p.pose.position.y, 0.0) for p in poses])
    if not points.size:
        return Navigation("", UNKNOWN_ORIGIN, "idle")
    if not (np.abs(points) <= _FARTHEST_M).all():
        raise UnreadableError("not_a_number", "a path")
    way = tuple((float(x), float(y)) for x, y, _ in place.apply(points))
    return Navigation("", UNKNOWN_ORIGIN, "navigating", way[-1], way)


@lru_cache(1024)
def clean(text: str) -> str:
    """Text without characters that Orion refuses."""
    return clean_text(text.translate(_FORBIDDEN)).strip()


# --- stamps -----------------------------------------------------------------------

Verdict = Literal["new", "same", "back", "reset"]
_SET_BACK_S = 1.0


@dataclass(slots=True)
class Stamps:
    """Newest stamp of one topic (s): 0 before the first."""

    newest: float = 0.0

    def verdict(self, stamp: float) -> Verdict:
        """``new``, ``same``, ``back``, or ``reset`` when the clock was set back."""
        if stamp == 0.0:  # the sender sets no stamp
            return "new"
        before, back_s = self.newest, self.newest - stamp
        if back_s == 0.0 or 0.0 < back_s < _SET_BACK_S:
            return "back" if back_s else "same"
        self.newest = stamp
        # A stamp far back is of a clock that was set: refusals would blind the robot.
        return "new" if stamp > before else "reset"


# --- input faults -----------------------------------------------------------------
#
# Faults of a robot's ROS 2 inputs: name and effect on the speed.
#
# A fault lasts as long as it is noted, and two seconds more; while it lasts the robot
# is slow, or halts where driving on would be a guess.

LASTS_S = 2.0
_MOST = 16

STANDS = frozenset({"second_publisher"})
"""Faults that hold the robot: another publisher on the drive bypasses the gate."""


@dataclass(frozen=True, slots=True)
class _Noted:
    """Start and end of a fault (monotonic, s); ``for_s`` None: since ``since``."""

    since: float
    last: float
    for_s: float | None


class InputFaults:
    """Record of faults; times are monotonic seconds."""

    def __init__(self) -> None:
        self._noted: dict[tuple[str, str], _Noted] = {}

    def note(
        self, code: str, about: str, now: float, for_s: float | None = None
    ) -> None:
        """Note a fault at this moment.

        Args:
            code: A short, stable name.
            about: Topic or frames.
            now: Monotonic (s).
            for_s: Duration so far, where known from elsewhere (s).
        """
        key = clean(code), clean(about)
        before = self._noted.get(key)
        fresh = before is None or now - before.last > LASTS_S
        since = now if fresh or before is None else before.since
        if fresh and len(self._noted) >= _MOST:
            del self._noted[min(self._noted, key=lambda key: self._noted[key].last)]
        self._noted[key] = _Noted(since, now, for_s)

    def clear(self) -> None:
        """Forget all of them."""
        self._noted.clear()

    def faults(self, now: float) -> tuple[RobotFault, ...]:
        """Present faults, in the order of their start."""
        self._noted = {
            key: fault
            for key, fault in self._noted.items()
            if now - fault.last <= LASTS_S
        }
        return tuple(
            RobotFault(
                code, about, now - fault.since if fault.for_s is None else fault.for_s
            )
            for (code, about), fault in self._noted.items()
        )


def speed_of(faults: Iterable[RobotFault]) -> tuple[float, str | None]:
    """Speed factor allowed with these faults, and the fault that determines it."""
    codes = [fault.code for fault in faults]
    if not codes:
        return FULL_SPEED, None
    stands = next((code for code in codes if code in STANDS), None)
    return (HALF_SPEED, codes[0]) if stands is None else (0.0, stands)
