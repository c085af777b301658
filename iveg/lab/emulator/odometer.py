"""The odometer of an emulated robot, with its errors."""

import math
from dataclasses import dataclass, field

import numpy as np

from iveg.domain.geometry import Pose2D, Twist2D, wrap_angle


@dataclass(slots=True)
class Odometer:
    """Odometry: the true pose with a bounded error.

    Each metre adds an error of about 2 % along and 1 % across, each radian turned one
    of 3 %, and earlier errors decay, as with the localizer behind
    ``base_pose_ground_truth``; the error is therefore bounded, and a robot at rest
    reports a constant pose.

    Attributes:
        along: Standard deviation, part of the way driven; ``across`` likewise.
        turning: Standard deviation, part of the angle turned.
        memory_m: Distance (m) over which an error decays; ``memory_rad`` likewise.
        times: How many times these errors it makes.
    """

    rng: np.random.Generator
    along: float = 0.02
    across: float = 0.01
    turning: float = 0.03
    memory_m: float = 2.0
    memory_rad: float = 1.0
    times: float = 1.0
    _error: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])

    def measure(self, truth: Pose2D, twist: Twist2D, dt: float) -> Pose2D:
        """The reported pose after moving with ``twist`` for ``dt`` (s)."""
        way, angle = abs(twist.linear_x) * dt, abs(twist.angular_z) * dt
        self._walk(0, self.along, way, self.memory_m)
        self._walk(1, self.across, way, self.memory_m)
        self._walk(2, self.turning, angle, self.memory_rad)
        # Driving along a row also corrects the heading of a localizer.
        self._error[2] *= math.exp(-way / self.memory_m)
        x, y = truth.transform(self._error[0], self._error[1])
        return Pose2D(x, y, wrap_angle(truth.yaw + self._error[2]))

    def _walk(self, which: int, part: float, moved: float, memory: float) -> None:
        # Ornstein-Uhlenbeck over the distance, not over time; its deviation is
        # part × memory, e.g. 2 % of 2 m = 4 cm.
        keep = math.exp(-moved / memory)
        spread = self.times * part * memory * math.sqrt(1.0 - keep * keep)
        fresh = float(self.rng.normal(0.0, spread)) if moved else 0.0
        self._error[which] = self._error[which] * keep + fresh
