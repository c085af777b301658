"""Robot motion: drives with limits.

Source: the seed paper (AGI turns on the spot, AGII has a turning radius of 2 m).  Left
out: slip, load, slopes.
"""

import math

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Twist2D, wrap_angle
from iveg.lab.emulator.greenhouse import Body

_TURN_ACCELERATION = 1.5
"""Angular acceleration of a differential drive (rad/s²); assumed."""

_STEERING_RATE = 0.6
"""Change of curvature of an Ackermann drive (1/m per s); assumed."""


class Vehicle:
    """A vehicle that executes drive commands within the limits of its profile."""

    def __init__(self, profile: RobotProfile, pose: Pose2D) -> None:
        self.profile = profile
        self.pose = pose
        self.twist = Twist2D(0.0, 0.0)
        self._curvature = 0.0

    def step(self, command: Twist2D, dt: float) -> None:
        """Drive for ``dt`` (s) as commanded, within the limits."""
        speed = self._speed(command.linear_x, dt)
        if self.profile.drive == "ackermann":
            turn = speed * self._steer(command, dt)
        else:
            turn = _towards(
                self.twist.angular_z,
                clip(command.angular_z, self.profile.max_turn),
                _TURN_ACCELERATION * dt,
            )
        middle = self.pose.yaw + turn * dt / 2
        self.pose = Pose2D(
            self.pose.x + speed * dt * math.cos(middle),
            self.pose.y + speed * dt * math.sin(middle),
            wrap_angle(self.pose.yaw + turn * dt),
        )
        self.twist = Twist2D(speed, turn)

    def _speed(self, wanted: float, dt: float) -> float:
        now, wanted = self.twist.linear_x, clip(wanted, self.profile.max_speed)
        slower = abs(wanted) < abs(now) or now * wanted < 0.0
        limit = self.profile.braking if slower else self.profile.acceleration
        return _towards(now, wanted, limit * dt)

    def _steer(self, command: Twist2D, dt: float) -> float:
        # A command without speed defines no steering angle: it stays as it is.
        if abs(command.linear_x) > 1e-3:
            wanted = command.angular_z / command.linear_x
            wanted = clip(wanted, 1.0 / self.profile.turning_radius)
            self._curvature = _towards(self._curvature, wanted, _STEERING_RATE * dt)
        return self._curvature

    def body(self, robot_id: str) -> Body:
        """Footprint of the vehicle."""
        return Body(robot_id, self.pose, self.profile.length, self.profile.width)


def clip(value: float, limit: float) -> float:
    """The value clipped to ±``limit``."""
    return min(max(value, -limit), limit)


def _towards(value: float, target: float, step: float) -> float:
    return value + clip(target - value, step)
