"""What a ROS 2 robot's topics say, for tests: everything has a default."""

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

from iveg.domain.observations import Instant, Observation
from iveg.robot.ros2.config import RobotConfig
from iveg.robot.ros2.inputs import Sensed, SensorInputs
from iveg.ros2 import cdr
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message

Kind = TypeVar("Kind", bound=Observation)
WALL = 1_700_000_000.0
MONO = 1000.0


def at(seconds: float) -> Instant:
    return Instant(MONO + seconds, WALL + seconds)


def stamp(seconds: float = 0.0) -> ros.Time:
    return ros.Time.from_seconds(WALL + seconds)


def turned(yaw: float) -> ros.Quaternion:
    return ros.Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))


def link(
    outer: str,
    inner: str,
    x: float = 0.0,
    y: float = 0.0,
    yaw: float = 0.0,
    *,
    after: float = 0.0,
    z: float = 0.0,
) -> ros.TransformStamped:
    transform = ros.Transform(ros.Vector3(x, y, z), turned(yaw))
    return ros.TransformStamped(ros.Header(stamp(after), outer), inner, transform)


def tf(*links: ros.TransformStamped) -> ros.TFMessage:
    return ros.TFMessage(links)


def odometry(
    x: float = 0.0,
    v: float = 0.5,
    *,
    after: float = 0.0,
    child: str = "base_link",
    w: float = 0.0,
) -> ros.Odometry:
    return ros.Odometry(
        ros.Header(stamp(after), "odom"),
        child,
        ros.PoseWithCovariance(ros.Pose(ros.Point(x))),
        ros.TwistWithCovariance(ros.Twist(ros.Vector3(v), ros.Vector3(z=w))),
    )


def scan(
    ranges: Sequence[float] = (1.0, 2.0, 3.0),
    *,
    after: float = 0.0,
    frame: str = "laser",
) -> ros.LaserScan:
    return ros.LaserScan(
        ros.Header(stamp(after), frame),
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
) -> ros.Detection3D:
    sure = ros.ObjectHypothesisWithPose(ros.ObjectHypothesis(class_id, score))
    box = ros.BoundingBox3D(
        ros.Pose(ros.Point(x, 0.0, 0.9)), ros.Vector3(0.4, 0.6, 1.8)
    )
    return ros.Detection3D(ros.Header(stamp(after), frame), (sure,), box, "7")


def look(*found: ros.Detection3D, after: float = 0.0) -> ros.Detection3DArray:
    return ros.Detection3DArray(ros.Header(stamp(after), "base_link"), found)


class Bench:
    """Senses that are told messages; by default all of TF is there.

    Args:
        heard_for: Time since the first message of the base (s).
        sim_time: Stamps are a simulator's.
    """

    def __init__(
        self,
        config: RobotConfig | None = None,
        *,
        tree: bool = True,
        heard_for: float = 1.0,
        sim_time: bool = False,
    ) -> None:
        self.inputs = SensorInputs(config or RobotConfig(), sim_time=sim_time)
        self.hear("tf", tf(), -heard_for)
        if tree:
            self.hear("tf_static", tf(link("base_link", "laser", 0.3)))
            self.hear("tf", tf(link("map", "odom", 10.0)))

    def hear(self, topic: str, message: Message, after: float = 0.0) -> "Bench":
        self.inputs.receive(topic, [cdr.write(message)], MONO + after)
        return self

    def sense(self, after: float = 0.0) -> list[Sensed]:
        return self.inputs.tick(at(after))

    def ages(self, after: float = 0.0) -> list[float]:
        return [round(sensed.age_s, 3) for sensed in self.sense(after)]

    def tick(self, after: float = 0.0) -> list[Observation]:
        return [sensed.observation for sensed in self.sense(after)]

    def only(self, kind: type[Kind], after: float = 0.0) -> Kind:
        """The one observation of this kind."""
        (found,) = (one for one in self.tick(after) if isinstance(one, kind))
        return found

    def faults(self, after: float = 0.0) -> dict[str, str]:
        """Code → what about."""
        found = self.inputs.input_faults.faults(MONO + after)
        return {one.code: one.about for one in found}
