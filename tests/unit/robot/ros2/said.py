"""What a ROS 2 robot's topics say, for tests: everything has a default."""

import math
from collections.abc import Sequence

import numpy as np

from iveg.domain.observations import Instant, Observation
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.inputs import SensorInputs
from iveg.ros2 import cdr, geometry_msgs, nav_msgs, sensor_msgs, std_msgs, vision_msgs
from iveg.ros2.schema import Message

WALL = 1_700_000_000.0
MONO = 1000.0


def at(seconds: float) -> Instant:
    return Instant(MONO + seconds, WALL + seconds)


def stamp(seconds: float = 0.0) -> std_msgs.Time:
    return std_msgs.Time.of(WALL + seconds)


def turned(yaw: float) -> geometry_msgs.Quaternion:
    return geometry_msgs.Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def link(
    outer: str,
    inner: str,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    *,
    after: float = 0.0,
    z: float = 0.0,
) -> geometry_msgs.TransformStamped:
    transform = geometry_msgs.Transform(geometry_msgs.Vector3(x, y, z), turned(yaw))
    return geometry_msgs.TransformStamped(
        std_msgs.Header(stamp(after), outer), inner, transform
    )


def tf(*links: geometry_msgs.TransformStamped) -> geometry_msgs.TFMessage:
    return geometry_msgs.TFMessage(links)


def odometry(
    x: float = 0.0,
    v: float = 0.5,
    *,
    after: float = 0.0,
    child: str = "base_link",
    w: float = 0.0,
) -> nav_msgs.Odometry:
    return nav_msgs.Odometry(
        std_msgs.Header(stamp(after), "odom"),
        child,
        geometry_msgs.PoseWithCovariance(geometry_msgs.Pose(geometry_msgs.Point(x))),
        geometry_msgs.TwistWithCovariance(
            geometry_msgs.Twist(geometry_msgs.Vector3(v), geometry_msgs.Vector3(z=w))
        ),
    )


def scan(
    ranges: Sequence[float] = (1.0, 2.0, 3.0),
    *,
    after: float = 0.0,
    frame: str = "laser",
) -> sensor_msgs.LaserScan:
    return sensor_msgs.LaserScan(
        std_msgs.Header(stamp(after), frame),
        -0.5, 0.5, 0.5, 0.0, 0.1, 0.1, 20.0,
        np.array(ranges, np.float32),
    )  # fmt: skip


def seen(
    class_id: str = "farmer",
    score: float = 0.9,
    x: float = 2.0,
    *,
    frame: str = "base_link",
    after: float = 0.0,
) -> vision_msgs.Detection3D:
    sure = vision_msgs.ObjectHypothesisWithPose(
        vision_msgs.ObjectHypothesis(class_id, score)
    )
    box = vision_msgs.BoundingBox3D(
        geometry_msgs.Pose(geometry_msgs.Point(x, 0.0, 0.9)),
        geometry_msgs.Vector3(0.4, 0.6, 1.8),
    )
    return vision_msgs.Detection3D(
        std_msgs.Header(stamp(after), frame), (sure,), box, "7"
    )


def look(
    *found: vision_msgs.Detection3D, after: float = 0.0
) -> vision_msgs.Detection3DArray:
    return vision_msgs.Detection3DArray(
        std_msgs.Header(stamp(after), "base_link"), found
    )


class Bench:
    """Senses that are told messages; by default all of TF is there.

    Args:
        heard_for: Time since the first message of the base (s).
    """

    def __init__(
        self,
        config: RobotConfig | None = None,
        *,
        tree: bool = True,
        classes: tuple[str, ...] = (),
        heard_for: float = 1.0,
    ) -> None:
        self.inputs = SensorInputs(config or RobotConfig(), classes)
        self.hear("tf", tf(), -heard_for)
        if tree:
            self.hear("tf_static", tf(link("base_link", "laser", 0.3)))
            self.hear("tf", tf(link("map", "odom", 10.0)))

    def hear(self, topic: str, message: Message, after: float = 0.0) -> "Bench":
        self.inputs.hear(topic, [cdr.write(message)], MONO + after)
        return self

    def tick(self, after: float = 0.0) -> list[Observation]:
        return self.inputs.tick(at(after))

    def faults(self, after: float = 0.0) -> dict[str, str]:
        """Code → what about."""
        found = self.inputs.input_faults.faults(MONO + after)
        return {one.code: one.about for one in found}
