"""Goals of iVeg as Nav2 takes them: ``geometry_msgs/PoseStamped`` on ``goal_pose``."""

import math

from iveg.domain.geometry import Pose2D
from iveg.domain.goals import Goal
from iveg.ros2 import geometry_msgs, std_msgs


def pose_for(
    goal: Goal | None, here: Pose2D, wall: float, frame: str
) -> geometry_msgs.PoseStamped:
    """The pose to drive to, looking the way that leads there.

    Args:
        goal: None, or one to pause: the pose where the robot is.
        here: Where it is, in ``map``.
        wall: The robot's clock (Unix s).
        frame: Name of ``map``.
    """
    if goal is None or goal.kind == "pause":
        x, y, yaw = here.x, here.y, here.yaw
    else:
        x, y = goal.x, goal.y
        yaw = math.atan2(y - here.y, x - here.x)
    turned = geometry_msgs.Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return geometry_msgs.PoseStamped(
        std_msgs.Header(std_msgs.Time.of(wall), frame),
        geometry_msgs.Pose(geometry_msgs.Point(x, y), turned),
    )
