"""The world as iVeg knows it: every robot with the age of everything about it.

``World.apply`` takes one observation; older ones and twins change nothing and are
counted.  Nothing here reads a clock: ages come from the ``now`` that is handed in.
"""

from bisect import bisect_left
from collections import Counter, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from iveg.domain.errors import UnknownRobotError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    Canary,
    Climate,
    DetectionFrame,
    Instant,
    LaserScan,
    Navigation,
    Observation,
    Odometry,
    Origin,
    Received,
    Road,
    SafetyReport,
)
from iveg.domain.order import ClockEstimate, Order, Verdict

Link = Literal["UNKNOWN", "LIVE", "LATE", "LOST"]

LIVE_S, LATE_S = 1.0, 3.0
STANDING_SPEED = 0.02
"""Below this (m/s and rad/s) a robot stands (safety.md §2.2)."""
REPLAY_TASK = "replay"
_HISTORY = 128
GAIN_OVER_S = 1.0


@dataclass(slots=True)
class RobotState:
    """What is known of one robot.

    Attributes:
        pose_at: Source moment of the newest odometry on our monotonic clock (s).
        heard_at: Arrival of the newest message of any kind (monotonic, s).
        detections_at: Arrival of the newest detection frame (monotonic, s).
        unreadable_at: When a detection last could not be used (monotonic, s).
    """

    robot_id: str
    odometry: Odometry | None = None
    odometry_received: Instant | None = None
    pose_at: float | None = None
    scan: LaserScan | None = None
    scan_pose: Pose2D | None = None
    scan_received: Instant | None = None
    frame: DetectionFrame | None = None
    frame_road: Road = "orion"
    detections_at: float | None = None
    unreadable_at: float | None = None
    safety: SafetyReport | None = None
    safety_received: Instant | None = None
    safety_road: Road = "orion"
    navigation: Navigation | None = None
    command_status: str | None = None
    heard_at: float | None = None
    clock: ClockEstimate = field(default_factory=ClockEstimate)
    _orders: dict[type[Observation], Order] = field(default_factory=dict)
    _poses: deque[tuple[float, Pose2D]] = field(
        default_factory=lambda: deque(maxlen=_HISTORY)
    )
    _speeds: deque[tuple[float, float]] = field(
        default_factory=lambda: deque(maxlen=_HISTORY)
    )

    def age_s(self, now: Instant) -> float | None:
        """Age of the pose (s); None before the first."""
        return None if self.pose_at is None else max(0.0, now.mono - self.pose_at)

    def link(self, now: Instant) -> Link:
        """LIVE, LATE or LOST by the age of the pose (product.md §2)."""
        age = self.age_s(now)
        if age is None:
            return "UNKNOWN"
        if age <= LIVE_S:
            return "LIVE"
        return "LATE" if age <= LATE_S else "LOST"

    @property
    def is_replay(self) -> bool:
        """Whether a recording plays this robot."""
        return self.navigation is not None and self.navigation.task == REPLAY_TASK

    @property
    def stands(self) -> bool:
        """Whether the newest odometry shows no motion."""
        if self.odometry is None:
            return False
        twist = self.odometry.twist
        return (
            abs(twist.linear_x) < STANDING_SPEED
            and abs(twist.angular_z) < STANDING_SPEED
        )

    def pose_at_stamp(self, stamp_s: float | None) -> Pose2D | None:
        """The pose at a moment of the robot's own clock, interpolated.

        Outside the short history the nearest end counts; without a stamp the newest.
        """
        poses = self._poses
        if not poses:
            return None
        if stamp_s is None or stamp_s >= poses[-1][0]:
            return poses[-1][1]
        index = bisect_left(poses, stamp_s, key=lambda entry: entry[0])
        if index == 0:
            return poses[0][1]
        (before, earlier), (after, later) = poses[index - 1], poses[index]
        return earlier.interpolate(later, (stamp_s - before) / (after - before))

    def speed_gained(self) -> float:
        """How much faster it is than in the mean of its last second (m/s)."""
        if self.odometry is None or not self._speeds:
            return 0.0
        mean = sum(speed for _, speed in self._speeds) / len(self._speeds)
        return abs(self.odometry.twist.linear_x) - mean

    def remember_speed(self, at: float, speed: float) -> None:
        """Keep a speed (m/s) for a second; ``at`` monotonic (s)."""
        self._speeds.append((at, abs(speed)))
        while at - self._speeds[0][0] > GAIN_OVER_S:
            self._speeds.popleft()

    def judge(
        self, observation: Observation, origin: Origin, *, asked: bool = False
    ) -> Verdict:
        """Place a message in its stream's order.

        What Orion kept of an earlier boot must not make the present one look old.
        """
        order = self._orders.setdefault(type(observation), Order())
        if asked and order.knows_better_than(origin):
            return "late"
        return order.judge(origin)

    def remember_pose(self, moment: float, pose: Pose2D) -> None:
        """Keep a pose for ``pose_at_stamp``; a clock that jumps back starts anew."""
        if self._poses and moment <= self._poses[-1][0]:
            if self._poses[-1][0] - moment > 1.0:
                self._poses.clear()
            else:
                return
        self._poses.append((moment, pose))


class World:
    """All robots of the fleet and the air around them."""

    def __init__(self, robot_ids: Sequence[str]) -> None:
        self.robots = {robot_id: RobotState(robot_id) for robot_id in robot_ids}
        self.climate: Climate | None = None
        self.climate_received: Instant | None = None
        self.canary_at: float | None = None
        self.counters: Counter[str] = Counter()

    def robot(self, robot_id: str) -> RobotState:
        """One robot.

        Raises:
            UnknownRobotError: not in the fleet.
        """
        try:
            return self.robots[robot_id]
        except KeyError:
            raise UnknownRobotError(robot_id) from None

    def apply(self, received: Received) -> Verdict:
        """Take one observation in.

        Returns:
            ``new`` when it became the state, else why it did not.

        Raises:
            UnknownRobotError: from a robot that is not in the fleet.
        """
        observation, at = received.observation, received.at
        if isinstance(observation, Climate):
            self.climate, self.climate_received = observation, at
            return "new"
        if isinstance(observation, Canary):
            self.canary_at = at.mono
            return "new"
        robot = self.robot(observation.robot_id)
        origin = getattr(observation, "origin", Origin())
        verdict = robot.judge(observation, origin, asked=received.asked)
        self.counters[f"{type(observation).__name__}.{verdict}"] += 1
        if verdict == "duplicate" or (received.asked and origin.seq is None):
            return "duplicate"
        if received.asked:
            delay = _age_when_asked(origin, at)
        else:
            robot.heard_at = at.mono
            delay = robot.clock.observe(origin, at)
        if verdict == "new":
            _update(robot, received, delay)
        return verdict

    def live_robots(self) -> Iterable[RobotState]:
        """Robots that are not recordings."""
        return (robot for robot in self.robots.values() if not robot.is_replay)


def _age_when_asked(origin: Origin, at: Instant) -> float:
    """How old Orion's answer is at least (s): nothing that was asked for looks live."""
    told = 0.0 if origin.stamp_s is None else at.wall - origin.stamp_s
    return max(told, LATE_S + 0.1)


def _update(robot: RobotState, received: Received, delay: float) -> None:
    observation, at = received.observation, received.at
    seen_at = at.later(-delay)
    match observation:
        case Odometry():
            robot.odometry, robot.odometry_received = observation, at
            robot.pose_at = _newer(robot.pose_at, seen_at)
            moment = observation.origin.stamp_s
            robot.remember_pose(at.wall if moment is None else moment, observation.pose)
            robot.remember_speed(seen_at.mono, observation.twist.linear_x)
        case LaserScan():
            robot.scan, robot.scan_received = observation, seen_at
            robot.scan_pose = robot.pose_at_stamp(observation.origin.stamp_s)
        case DetectionFrame():
            robot.frame, robot.frame_road = observation, received.road
            robot.detections_at = _newer(robot.detections_at, seen_at)
            if observation.unreadable:
                robot.unreadable_at = at.mono
        case SafetyReport():
            robot.safety, robot.safety_received = observation, seen_at
            robot.safety_road = received.road
        case Navigation():
            robot.navigation = observation
        case _:
            robot.command_status = getattr(observation, "status", robot.command_status)


def _newer(before: float | None, seen_at: Instant) -> float:
    """What is newer by its order cannot be older than what was known before it."""
    return seen_at.mono if before is None else max(before, seen_at.mono)
