"""Messages of ``geometry_msgs`` and ``tf2_msgs``: places, velocities and frames."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from iveg.ros2.schema import Float64, Many, Message
from iveg.ros2.std_msgs import Stamped

Covariance = Annotated[NDArray[np.float64], Many("float64", 36)]


@dataclass(frozen=True, slots=True)
class Point(Message, package="geometry_msgs"):
    """(m)."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class Vector3(Message, package="geometry_msgs"):
    """(m), (m/s) or (rad/s)."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class Quaternion(Message, package="geometry_msgs"):
    """A rotation; the default is the identity."""

    x: Float64 = 0.0
    y: Float64 = 0.0
    z: Float64 = 0.0
    w: Float64 = 1.0


@dataclass(frozen=True, slots=True)
class Pose(Message, package="geometry_msgs"):
    """Position and orientation."""

    position: Point = Point()
    orientation: Quaternion = Quaternion()


@dataclass(frozen=True, slots=True)
class PoseStamped(Stamped, package="geometry_msgs"):
    """A pose in the header's frame."""

    pose: Pose = Pose()


@dataclass(frozen=True, slots=True, eq=False)
class PoseWithCovariance(Message, package="geometry_msgs"):
    """A pose with its covariance."""

    pose: Pose = Pose()
    covariance: Covariance = field(default_factory=lambda: np.zeros(36))


@dataclass(frozen=True, slots=True)
class Twist(Message, package="geometry_msgs"):
    """Velocities: along and about the axes."""

    linear: Vector3 = Vector3()
    angular: Vector3 = Vector3()


@dataclass(frozen=True, slots=True)
class TwistStamped(Stamped, package="geometry_msgs"):
    """A twist in the header's frame."""

    twist: Twist = Twist()


@dataclass(frozen=True, slots=True, eq=False)
class TwistWithCovariance(Message, package="geometry_msgs"):
    """A twist with its covariance."""

    twist: Twist = Twist()
    covariance: Covariance = field(default_factory=lambda: np.zeros(36))


@dataclass(frozen=True, slots=True)
class Transform(Message, package="geometry_msgs"):
    """Pose of a frame in another."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


@dataclass(frozen=True, slots=True)
class TransformStamped(Stamped, package="geometry_msgs"):
    """Pose of ``child_frame_id`` in the header's frame."""

    child_frame_id: str = ""
    transform: Transform = Transform()


@dataclass(frozen=True, slots=True)
class TFMessage(Message, package="tf2_msgs"):
    """Content of ``/tf`` and ``/tf_static``."""

    transforms: tuple[TransformStamped, ...] = ()
