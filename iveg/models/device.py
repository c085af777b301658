"""Devices of a robot at the IoT Agent, with the time of their last message."""

from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.models.base import Model


class Device(Model):
    """One device of a robot."""

    device: str
    robot_id: str
    kind: str
    """``robot`` for the device of all orders, else what it measures."""
    age_s: float | None
    """Since something came of it; null: never."""

    @classmethod
    def of(cls, robot: RobotState, suffix: str, now: Instant) -> "Device":
        """The device whose name is the robot's id and ``suffix``."""
        heard_at = _heard_at(robot, suffix)
        return cls(
            device=robot.robot_id + suffix,
            robot_id=robot.robot_id,
            kind=suffix[1:] or "robot",
            age_s=None if heard_at is None else round(max(0.0, now.mono - heard_at), 3),
        )


def _heard_at(robot: RobotState, suffix: str) -> float | None:
    """When something of a device came in (monotonic, s)."""
    if suffix == "":
        return robot.heard_at
    newest: dict[str, Instant | None] = {
        "_odom": robot.odometry_received,
        "_lidar2D": robot.scan_received,
        "_yolox_bounding_boxes": robot.sighted_at,
        "_safety": robot.safety_received,
        "_nav": robot.navigation_received,
        **{f"_{of.__name__.lower()}": one.at for of, one in robot.sensed.items()},
    }
    at = newest.get(suffix)
    return None if at is None else at.mono
