"""Messages of ``vision_msgs`` 4: what a detector found in a picture."""

from dataclasses import dataclass, field
from typing import ClassVar

from iveg.ros2.geometry_msgs import Pose, PoseWithCovariance, Vector3
from iveg.ros2.schema import Float64, Message
from iveg.ros2.std_msgs import Stamped


@dataclass(frozen=True, slots=True)
class ObjectHypothesis(Message, package="vision_msgs"):
    """Class hypothesis; ``score`` 0 to 1."""

    class_id: str = ""
    score: Float64 = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class ObjectHypothesisWithPose(Message, package="vision_msgs"):
    """Class hypothesis with pose."""

    hypothesis: ObjectHypothesis = ObjectHypothesis()
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)


@dataclass(frozen=True, slots=True)
class BoundingBox3D(Message, package="vision_msgs"):
    """A box about its centre; ``size`` (m)."""

    center: Pose = field(default_factory=Pose)
    size: Vector3 = field(default_factory=Vector3)


@dataclass(frozen=True, slots=True, eq=False)
class Detection3D(Stamped, package="vision_msgs"):
    """One detected object."""

    results: tuple[ObjectHypothesisWithPose, ...] = ()
    bbox: BoundingBox3D = BoundingBox3D()
    id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Detection3DArray(Stamped, package="vision_msgs"):
    """Detections of one picture, with depth."""

    detections: tuple[Detection3D, ...] = ()


@dataclass(frozen=True, slots=True)
class Point2D(Message, package="vision_msgs"):
    """(pixels)."""

    x: Float64 = 0.0
    y: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class PicturePose(Message):
    """``vision_msgs/Pose2D``: pixels and a turn (rad)."""

    ROS: ClassVar[str] = "vision_msgs/msg/Pose2D"
    position: Point2D = Point2D()
    theta: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class BoundingBox2D(Message, package="vision_msgs"):
    """A box about its centre (pixels)."""

    center: PicturePose = PicturePose()
    size_x: Float64 = 0.0
    size_y: Float64 = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Detection2D(Stamped, package="vision_msgs"):
    """One object detected in a picture."""

    results: tuple[ObjectHypothesisWithPose, ...] = ()
    bbox: BoundingBox2D = BoundingBox2D()
    id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Detection2DArray(Stamped, package="vision_msgs"):
    """Detections of one picture, without depth."""

    detections: tuple[Detection2D, ...] = ()
