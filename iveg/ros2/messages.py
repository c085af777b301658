"""The ROS 2 messages that iVeg reads and writes, field for field as ROS defines them.

Layouts are those of ROS 2 Humble and later (``vision_msgs`` 4).  Units and frames are
those of REP-103 and REP-105.
"""

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from iveg.ros2.schema import (
    Boolean,
    Float32,
    Float64,
    Int32,
    Many,
    Message,
    Uint8,
    Uint32,
)

Floats = Annotated[NDArray[np.float32], Many("float32")]
Doubles = Annotated[NDArray[np.float64], Many("float64")]
Cells = Annotated[NDArray[np.int8], Many("int8")]
Octets = Annotated[NDArray[np.uint8], Many("uint8")]
Covariance = Annotated[NDArray[np.float64], Many("float64", 36)]
Nine = Annotated[NDArray[np.float64], Many("float64", 9)]
Twelve = Annotated[NDArray[np.float64], Many("float64", 12)]


def _none() -> NDArray[np.float32]:
    return np.zeros(0, np.float32)


@dataclass(frozen=True, slots=True)
class Time(Message, package="builtin_interfaces"):
    """Seconds and nanoseconds since 1970."""

    sec: Int32 = 0
    nanosec: Uint32 = 0

    @classmethod
    def of(cls, seconds: float) -> "Time":
        """The stamp of a Unix time (s)."""
        whole = math.floor(seconds)
        return cls(whole, min(999_999_999, round((seconds - whole) * 1e9)))

    @property
    def seconds(self) -> float:
        """Unix time (s)."""
        return self.sec + self.nanosec / 1e9


@dataclass(frozen=True, slots=True)
class Duration(Message, package="builtin_interfaces"):
    """A duration (s, ns)."""

    sec: Int32 = 0
    nanosec: Uint32 = 0


@dataclass(frozen=True, slots=True)
class Header(Message, package="std_msgs"):
    """Time of measurement, and frame."""

    stamp: Time = Time()
    frame_id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Stamped(Message):
    """What messages with a header have in common: it is their first field."""

    header: Header = Header()


@dataclass(frozen=True, slots=True)
class ColorRGBA(Message, package="std_msgs"):
    """Each 0 to 1."""

    r: Float32 = 0.0
    g: Float32 = 0.0
    b: Float32 = 0.0
    a: Float32 = 1.0


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


@dataclass(frozen=True, slots=True, eq=False)
class Odometry(Stamped, package="nav_msgs"):
    """Pose of ``child_frame_id`` in the header's frame; the twist in the child's."""

    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass(frozen=True, slots=True)
class Path(Stamped, package="nav_msgs"):
    """Planned path of navigation."""

    poses: tuple[PoseStamped, ...] = ()


@dataclass(frozen=True, slots=True)
class MapMetaData(Message, package="nav_msgs"):
    """Size (m, cells) of a grid, and where its first cell begins."""

    map_load_time: Time = Time()
    resolution: Float32 = 0.0
    width: Uint32 = 0
    height: Uint32 = 0
    origin: Pose = Pose()


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid(Stamped, package="nav_msgs"):
    """Costs row by row, 0 to 100; -1 unknown."""

    info: MapMetaData = MapMetaData()
    data: Cells = field(default_factory=lambda: np.zeros(0, np.int8))


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan(Stamped, package="sensor_msgs"):
    """One sweep; ``ranges`` of shape (n,), (m)."""

    angle_min: Float32 = 0.0
    angle_max: Float32 = 0.0
    angle_increment: Float32 = 0.0
    time_increment: Float32 = 0.0
    scan_time: Float32 = 0.0
    range_min: Float32 = 0.0
    range_max: Float32 = 0.0
    ranges: Floats = field(default_factory=_none)
    intensities: Floats = field(default_factory=_none)


@dataclass(frozen=True, slots=True, eq=False)
class BatteryState(Stamped, package="sensor_msgs"):
    """Volts, °C, amperes, ampere hours; ``percentage`` 0 to 1, NaN when unknown."""

    voltage: Float32 = 0.0
    temperature: Float32 = 0.0
    current: Float32 = 0.0
    charge: Float32 = 0.0
    capacity: Float32 = 0.0
    design_capacity: Float32 = 0.0
    percentage: Float32 = 0.0
    power_supply_status: Uint8 = 0
    power_supply_health: Uint8 = 0
    power_supply_technology: Uint8 = 0
    present: Boolean = True
    cell_voltage: Floats = field(default_factory=_none)
    cell_temperature: Floats = field(default_factory=_none)
    location: str = ""
    serial_number: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Image(Stamped, package="sensor_msgs"):
    """Rows of ``step`` bytes each; depth pictures are ``16UC1`` (mm), ``32FC1`` (m)."""

    height: Uint32 = 0
    width: Uint32 = 0
    encoding: str = ""
    is_bigendian: Uint8 = 0
    step: Uint32 = 0
    data: Octets = field(default_factory=lambda: np.zeros(0, np.uint8))


@dataclass(frozen=True, slots=True)
class RegionOfInterest(Message, package="sensor_msgs"):
    """A part of a picture (pixels)."""

    x_offset: Uint32 = 0
    y_offset: Uint32 = 0
    height: Uint32 = 0
    width: Uint32 = 0
    do_rectify: Boolean = False


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfo(Stamped, package="sensor_msgs"):
    """Calibration of a camera; ``p`` is the projection of the rectified picture."""

    height: Uint32 = 0
    width: Uint32 = 0
    distortion_model: str = ""
    d: Doubles = field(default_factory=lambda: np.zeros(0))
    k: Nine = field(default_factory=lambda: np.zeros(9))
    r: Nine = field(default_factory=lambda: np.zeros(9))
    p: Twelve = field(default_factory=lambda: np.zeros(12))
    binning_x: Uint32 = 0
    binning_y: Uint32 = 0
    roi: RegionOfInterest = RegionOfInterest()


@dataclass(frozen=True, slots=True)
class PointField(Message, package="sensor_msgs"):
    """One field of each point; ``datatype`` 7 is float32."""

    name: str = ""
    offset: Uint32 = 0
    datatype: Uint8 = 7
    count: Uint32 = 1


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud2(Stamped, package="sensor_msgs"):
    """``width`` × ``height`` points of ``point_step`` bytes each."""

    height: Uint32 = 1
    width: Uint32 = 0
    fields: tuple[PointField, ...] = ()
    is_bigendian: Boolean = False
    point_step: Uint32 = 0
    row_step: Uint32 = 0
    data: Octets = field(default_factory=lambda: np.zeros(0, np.uint8))
    is_dense: Boolean = True


@dataclass(frozen=True, slots=True, eq=False)
class CompressedImage(Stamped, package="sensor_msgs"):
    """A part of ``Marker`` that iVeg leaves empty."""

    format: str = ""
    data: Octets = field(default_factory=lambda: np.zeros(0, np.uint8))
