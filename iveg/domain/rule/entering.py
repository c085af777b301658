"""What a robot was doing as it entered a ring: what a slow-down can show there.

A robot that is slow already, or that has not reached its speed yet, shows none, and a
robot that judges for itself may have told of this very ring before (docs/dashboard.md,
"Decisions").
"""

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.zones import Zone

SPEEDING_UP = 0.05
"""Faster than in the mean of its last second by more than this (m/s)."""
_FREED_S = 1.0
"""So long after it was let go a robot may still be about as slow as before."""


def is_speeding_up(robot: RobotState, now: Instant) -> bool:
    """Whether a robot has not reached the speed that it wants."""
    was_freed = now.mono - robot.freed_at < _FREED_S
    return was_freed or robot.speed_gained() > SPEEDING_UP


def is_slow_already(robot: RobotState, zone: Zone, speed: float) -> bool:
    """Whether a robot will show no slow-down, because it drives slowly already.

    A robot judges alerts by its own pose, too, and may report this very zone a few
    milliseconds before it is found here; while it is still fast, its slow-down is yet
    to be seen.
    """
    if robot.safety is None or robot.safety.speed_factor > HALF_SPEED:
        return False
    slow = HALF_SPEED * robot.profile.max_speed
    return not is_ahead(robot, zone) or speed <= slow


def is_ahead(robot: RobotState, zone: Zone) -> bool:
    """Whether the robot already reports that it is slow for this very hazard."""
    report = robot.safety
    if report is None or report.speed_factor > HALF_SPEED:
        return False
    if zone.reason == report.reason == "obstacle":
        return True
    # A peer's own ring has no alert, and a robot may name none: that is no match.
    ours = {zone.alert_id, zone.cause} - {None}
    return report.decision_id in ours or report.cause in ours
