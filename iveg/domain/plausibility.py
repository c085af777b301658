"""Whether what a robot says can be true: by physics, and by what it said before.

Each finding is a code, a contradiction of :class:`~iveg.domain.doubt.Doubts`; what
cannot be true of any robot is refused before it comes here (``ngsi.payloads``).  A
robot that nobody described has no greatest speed, and one without a clock of its own
is judged by arrival.  docs/safety.md, "Doubt", has the table.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from iveg.domain.age import FeedbackLedger
from iveg.domain.geometry import Rectangle
from iveg.domain.limits import LIMITS
from iveg.domain.observations import Odometry, Origin, Received, SafetyReport
from iveg.domain.robot_state import RobotState

_SPEED_SHARE, _SPEED_M_S = 1.25, 0.25
"""A drive may overshoot its greatest speed by this, and odometry is noisy (1, m/s)."""
_TURN_SHARE, _TURN_RAD_S = 1.5, 0.5
_JUMP_M = 0.5
"""Corrections of a localisation are smaller (m)."""
_CLOCK_S = 10.0
"""So much more time than passed here a robot's clock may tell (s)."""
_SAME_MOMENT_S = 0.1
_MOVES_M_S = 0.2
"""Odometry and report of one moment differ by less (m/s)."""


@dataclass(frozen=True, slots=True)
class Plausibility:
    """Judges what robots say.

    Attributes:
        bounds: Of the greenhouse; None: nobody knows where its robots may be.
        ledger: Which feedback was ever sent.
    """

    bounds: Rectangle | None
    ledger: FeedbackLedger

    def contradictions(self, robot: RobotState, received: Received) -> Iterator[str]:
        """Codes of what contradicts the robot's state before this message."""
        observation, at = received.observation, received.at.mono
        if isinstance(observation, Odometry):
            yield from self._of_odometry(robot, observation, at)
            yield from self._of_origin(observation.origin)
        elif isinstance(observation, SafetyReport):
            if _stands_while_moving(robot, observation):
                yield "stands_moving"
            yield from self._of_origin(observation.origin)

    def _of_odometry(
        self, robot: RobotState, odometry: Odometry, at: float
    ) -> Iterator[str]:
        if self._is_outside(odometry):
            yield "pose_outside"
        if _is_too_fast(robot, odometry):
            yield "too_fast"
        if _has_jumped(robot, odometry, at):
            yield "jumped"

    def _of_origin(self, origin: Origin) -> Iterator[str]:
        if self.ledger.is_unsent(origin.heard):
            yield "heard_unsent"

    def _is_outside(self, odometry: Odometry) -> bool:
        """Whether a pose is farther outside the walls than they are apart."""
        bounds, pose = self.bounds, odometry.pose
        if bounds is None:
            return False
        size = max(bounds.xmax - bounds.xmin, bounds.ymax - bounds.ymin)
        return not bounds.contains(pose.x, pose.y, size)


def _is_too_fast(robot: RobotState, odometry: Odometry) -> bool:
    if not robot.description.is_described:
        return False
    profile, twist = robot.profile, odometry.twist
    return (
        abs(twist.linear_x) > _SPEED_SHARE * profile.max_speed + _SPEED_M_S
        or abs(twist.angular_z) > _TURN_SHARE * profile.max_turn + _TURN_RAD_S
    )


def _has_jumped(robot: RobotState, odometry: Odometry, at: float) -> bool:
    """Whether it cannot have come here since its odometry before, of the same boot."""
    before, received = robot.odometry, robot.odometry_received
    if before is None or received is None or not robot.description.is_described:
        return False
    if before.origin.boot != odometry.origin.boot:
        return False
    passed = at - received.mono
    own, earlier = odometry.origin.own_s, before.origin.own_s
    if own is not None and earlier is not None:
        passed = max(passed, min(own - earlier, passed + _CLOCK_S))
    reach = _SPEED_SHARE * robot.profile.max_speed + _SPEED_M_S
    pose = odometry.pose
    return before.pose.distance_to(pose.x, pose.y) > reach * passed + _JUMP_M


def _stands_while_moving(robot: RobotState, report: SafetyReport) -> bool:
    """Whether it reports rest at a moment at which its wheels turned."""
    odometry = robot.odometry
    if odometry is None or odometry.origin.boot != report.origin.boot:
        return False
    moment, driven = report.origin.mono, odometry.origin.mono
    if moment is None or driven is None or abs(moment - driven) > _SAME_MOMENT_S:
        return False
    rests = abs(report.linear) < LIMITS.standing_speed
    return rests and abs(odometry.twist.linear_x) >= _MOVES_M_S


def ignores_limit(report: SafetyReport, measured_at: float, limited_at: float) -> bool:
    """Whether a robot drives at a factor above its limit long after it was told.

    Args:
        report: What it applies.
        measured_at: The report was not measured before this moment (monotonic, s).
        limited_at: When the limit was first told (monotonic, s).
    """
    waited = measured_at - limited_at
    return report.speed_factor > LIMITS.slow_factor and waited > LIMITS.release_within_s
