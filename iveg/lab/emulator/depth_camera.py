"""A depth camera on a robot: its picture, its height and its errors.

Sources of the noise: Intel's D400 tuning paper (disparity error 0.08 pixels, baseline
50 mm) and Point Grey's Bumblebee2 sheet (120 mm).
"""

from dataclasses import dataclass

from iveg.domain.fleet import RobotProfile
from iveg.robot.grounding.cloud import Pinhole


@dataclass(frozen=True, slots=True)
class DepthCamera:
    """Depth camera on a robot, looking level.

    Attributes:
        lens: Of the picture that the depth is registered to.
        height: Above the floor (m).
        most: Largest measured depth (m).
        baseline: Between the two imagers (m).
        disparity_error: Standard deviation (pixels); depth errs by z² · e / (f · b).
        dropouts: Share of pixels that are not measured, 0 to 1.
    """

    lens: Pinhole
    height: float
    most: float
    baseline: float = 0.05
    disparity_error: float = 0.08
    dropouts: float = 0.005

    @classmethod
    def of(cls, profile: RobotProfile, baseline: float = 0.05) -> "DepthCamera":
        """The camera of a kind of robot, 640 × 480."""
        lens = Pinhole.across(profile.camera_fov)
        return cls(lens, profile.camera_height, profile.camera_range, baseline)
