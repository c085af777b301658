"""What is known of each kind of robot: size, drive, limits, where its sensors sit.

Sources: the seed paper (AGI is a Husky with an RGB-D camera at (0.4, 0, 0.6) m; AGII
is Ackermann with a 2 m turning radius and a stereo camera at (0.35, 0, 0.6) m) and
Clearpath's Husky sheet (0.99 × 0.57 m, 1.0 m/s); Intel's D435 sheet (RGB 69° across)
and Point Grey's Bumblebee2 sheet (66°); the ranges of useful depth are assumed.
Braking is not measured for these machines, so the margin uses the cautious 0.5 m/s²
(safety.md §6.2).
"""

import math
from dataclasses import dataclass

from iveg.domain.geometry import Pose2D
from iveg.domain.limits import LIMITS


@dataclass(frozen=True, slots=True)
class RobotProfile:
    """One kind of robot.

    Attributes:
        drive: ``differential`` (turns on the spot) or ``ackermann``.
        length: Along x (m); ``width`` along y (m).
        max_speed: (m/s); ``max_turn`` (rad/s).
        turning_radius: Least radius (m); 0 for one that turns on the spot.
        acceleration: (m/s²); ``braking`` (m/s²) what the drive does when asked to halt.
        assumed_braking: What margins may count on (m/s²).
        camera: Pose of the camera in ``base_link``; ``camera_height`` (m).
        camera_fov: What the camera sees across (rad); ``camera_range`` (m).
        laser: Pose of the laser in ``base_link``.
    """

    drive: str = "differential"
    length: float = 1.0
    width: float = 0.6
    max_speed: float = 1.0
    max_turn: float = 1.0
    turning_radius: float = 0.0
    acceleration: float = 0.5
    braking: float = 1.0
    assumed_braking: float = LIMITS.least_braking_m_s2
    camera: Pose2D = Pose2D(0.4, 0.0, 0.0)
    camera_height: float = 0.6
    camera_fov: float = math.radians(69.0)
    camera_range: float = 8.0
    laser: Pose2D = Pose2D(0.0, 0.0, 0.0)


AGI = RobotProfile(length=0.99, width=0.57)
AGII = RobotProfile(
    drive="ackermann",
    length=1.4,
    width=0.8,
    max_turn=0.5,
    turning_radius=2.0,
    camera=Pose2D(0.35, 0.0, 0.0),
    camera_fov=math.radians(66.0),
    camera_range=10.0,
)

_KNOWN = {"AGI": AGI, "AGII": AGII}


def profile_of(robot_id: str) -> RobotProfile:
    """The profile of a robot; one that nobody described drives like AGI."""
    return _KNOWN.get(robot_id, AGI)
