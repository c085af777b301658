"""Overload by detections: its bounds, and which robots drive slower for it.

At most 256 people are kept and 45 pictures a second of each robot are judged.
Detections beyond that never displace a known person, but somebody new may be among
them.  So the observer and every robot near what it can see drive at half speed until a
picture of that observer was judged whole.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.world import World

PICTURES_HZ = 45.0
"""Of one robot, in the mean of a second; the contract's rate is 30 Hz."""
_OPEN_FROM_M = 2000.0


@dataclass(slots=True)
class Overload:
    """Which robots' newest picture was not judged whole.

    Attributes:
        since: By robot, when that began (monotonic, s).
        last: By robot, when it was last so; never forgotten.
    """

    since: dict[str, float] = field(default_factory=dict)
    last: dict[str, float] = field(default_factory=dict)
    _left: dict[str, tuple[float, float]] = field(default_factory=dict)

    def admits(self, robot_id: str, now: Instant) -> bool:
        """Whether one more picture of a robot may be judged; counts it if so."""
        left, at = self._left.get(robot_id, (PICTURES_HZ, now.mono))
        left = min(PICTURES_HZ, left + PICTURES_HZ * max(0.0, now.mono - at))
        admitted = left >= 1.0
        self._left[robot_id] = left - admitted, now.mono
        return admitted

    def judged(self, robot_id: str, now: Instant, *, whole: bool) -> None:
        """Note a judged picture; ``whole`` when every detection in it was taken."""
        if whole:
            self.since.pop(robot_id, None)
        else:
            self.since.setdefault(robot_id, now.mono)
            self.last[robot_id] = now.mono

    def slowed(self, world: World, bounds_width: float) -> Mapping[str, str]:
        """Robots that must drive at half speed, and for whose pictures.

        Args:
            world: Where everybody is.
            bounds_width: Of the greenhouse (m); an open field slows the whole fleet.
        """
        found: dict[str, str] = {}
        for name in self.since:
            observer = world.robots[name]
            whole_fleet = bounds_width > _OPEN_FROM_M
            for robot in _near(observer, world.robots.values(), whole_fleet):
                found.setdefault(robot.robot_id, name)
        return found


def _near(
    observer: RobotState, robots: Iterable[RobotState], whole_fleet: bool
) -> Iterable[RobotState]:
    reach = observer.profile.camera_range + LIMITS.ring_most_m
    here = _pose(observer)
    for robot in robots:
        # A recording's detections slow recordings of its frame alone.
        if observer.recording not in (None, robot.recording):
            continue
        there = _pose(robot)
        if (
            robot is observer
            or whole_fleet
            or here is None
            or there is None
            or here.distance_to(there.x, there.y) <= reach
        ):
            yield robot


def _pose(robot: RobotState) -> Pose2D | None:
    return None if robot.odometry is None else robot.odometry.pose
