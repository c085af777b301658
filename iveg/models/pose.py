"""Where a robot is and how it moves, in ``map``."""

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.models.base import Model


class Pose(Model):
    """Pose of ``base_link`` in ``map``."""

    x: float
    y: float
    yaw: float

    @classmethod
    def of(cls, pose: Pose2D) -> "Pose":
        """As the robot measured it."""
        return cls(x=pose.x, y=pose.y, yaw=pose.yaw)


class Twist(Model):
    """Speed (m/s) and turn rate (rad/s)."""

    linear: float
    angular: float

    @classmethod
    def of(cls, twist: Twist2D) -> "Twist":
        """As the robot measured it."""
        return cls(linear=twist.linear_x, angular=twist.angular_z)
