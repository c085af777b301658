"""Topics of a ROS 2 robot: one row each, in the order in which they are read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from iveg.robot.ros2.detectors import BOXES, LOOKS
from iveg.robot.ros2.sensors import ROS_SENSORS
from iveg.ros2 import (
    geometry_msgs,
    nav_msgs,
    sensor_msgs,
    vision_msgs,
    visualization_msgs,
)
from iveg.ros2.names import DEFAULT, LATCHED, SENSOR_DATA, TF, TF_STATIC, Qos
from iveg.ros2.schema import Message

Role = Literal["stream", "state", "picture", "transforms", "drive", "output"]
"""``stream``: old messages do not count; ``state``: the newest counts; ``picture``: one
of which few may be pending; ``transforms``: every message counts; ``drive``: on either
side of the gate, stamped or not; ``output``: what goals and neighbours go out on."""


@dataclass(frozen=True, slots=True)
class RosTopic:
    """One row.

    Attributes:
        name: As in ROS nodes, by default: relative ones are below the namespace;
            empty: none.
        message: Its type.
        qos: A best-effort reader matches every writer; only commands are read reliably.
        forms: All types that are read; a detector publishes one of several.
    """

    name: str
    message: type[Message]
    role: Role = "state"
    qos: Qos = SENSOR_DATA
    forms: tuple[type[Message], ...] = ()

    def __post_init__(self) -> None:
        if not self.forms:
            object.__setattr__(self, "forms", (self.message,))

    def form(self, ros_type: str) -> type[Message] | None:
        """The type of this ROS name; None for one that is not read."""
        return next((one for one in self.forms if ros_type == one.ROS), None)


TOPICS: Mapping[str, RosTopic] = {
    "odometry": RosTopic("odom", nav_msgs.Odometry, "stream"),
    "scan": RosTopic("scan", sensor_msgs.LaserScan, "stream"),
    "detections_3d": RosTopic(
        "detections_3d", vision_msgs.Detection3DArray, "stream", forms=tuple(BOXES)
    ),
    # With depth and camera_info an alternative to detections_3d.
    "detections_2d": RosTopic(
        "", vision_msgs.Detection2DArray, "stream", forms=tuple(LOOKS)
    ),
    "depth": RosTopic(
        "camera/aligned_depth_to_color/image_raw", sensor_msgs.Image, "picture"
    ),
    "camera_info": RosTopic("camera/color/camera_info", sensor_msgs.CameraInfo),
    # In a mono picture value n marks the n-th detection; without, the whole box counts.
    "mask": RosTopic("", sensor_msgs.Image, "picture"),
    **{name: RosTopic(one.topic, one.message) for name, one in ROS_SENSORS.items()},
    "path": RosTopic("plan", nav_msgs.Path),
    # After a pause each datum finds the transform that was published before it, though
    # both arrive while the topics are being read.
    "tf_static": RosTopic(
        "tf_static", geometry_msgs.TFMessage, "transforms", TF_STATIC
    ),
    "tf": RosTopic("tf", geometry_msgs.TFMessage, "transforms", TF),
    "cmd_vel_in": RosTopic("cmd_vel_nav", geometry_msgs.Twist, "drive"),
    "cmd_vel_out": RosTopic("cmd_vel", geometry_msgs.Twist, "drive", DEFAULT),
    # Goals of iVeg, as Nav2 takes them.
    "goal": RosTopic("goal_pose", geometry_msgs.PoseStamped, "output", DEFAULT),
    # People and peers, for Nav2's obstacle layer and for RViz.
    "obstacles": RosTopic("iveg/obstacles", sensor_msgs.PointCloud2, "output", DEFAULT),
    "markers": RosTopic(
        "iveg/markers", visualization_msgs.MarkerArray, "output", DEFAULT
    ),
    # The fleet's picture, for Nav2's static layer.
    "costmap": RosTopic("iveg/costmap", nav_msgs.OccupancyGrid, "output", LATCHED),
}
"""By key in ``robot.toml``."""

_CAMERA = frozenset({"depth", "camera_info", "mask"})


def sensed_topics(names: Mapping[str, str]) -> dict[str, str]:
    """Topics that a robot's sensors publish on: key → full name.

    A camera is read only where detections have no depth.
    """
    unread = frozenset() if names["detections_2d"] else _CAMERA
    return {
        key: names[key]
        for key, topic in TOPICS.items()
        if topic.role not in ("drive", "output") and names[key] and key not in unread
    }
