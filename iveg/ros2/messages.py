"""Messages of ROS 2 as frozen dataclasses, with ROS's names and fields in ROS's order.

Their bytes follow the definitions of ROS, which ``cdr`` has.
"""

import math
from abc import ABC
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray


class Message(ABC):
    """A ROS message: base of frozen dataclasses with ROS's names and fields.

    Args:
        package: ROS package of the message.

    Attributes:
        ROS: Its ROS name, such as ``nav_msgs/msg/Odometry``.
        NEWER: Another definition of the same name, by which it is read as well.
    """

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Any]]
    ROS: ClassVar[str]
    NEWER: ClassVar["type[Message] | None"] = None

    def __init_subclass__(cls, package: str | None = None) -> None:
        # A dataclass with slots is made a second time, then without the package.
        if package is not None:
            cls.ROS = f"{package}/msg/{cls.__name__}"


def definitions(message: type[Message]) -> tuple[type[Message], ...]:
    """All definitions of a message, the newest first."""
    return (message,) if message.NEWER is None else (message.NEWER, message)


# --- std msgs ---------------------------------------------------------------------
#
# Messages of ``builtin_interfaces`` and ``std_msgs``: times, headers and colours.


@dataclass(frozen=True, slots=True)
class Time(Message, package="builtin_interfaces"):
    """Seconds and nanoseconds since 1970."""

    sec: int = 0
    nanosec: int = 0

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

    sec: int = 0
    nanosec: int = 0


@dataclass(frozen=True, slots=True)
class Header(Message, package="std_msgs"):
    """Time of measurement, and frame."""

    stamp: Time = Time()
    frame_id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Stamped(Message):
    """Base of messages with a header, which is their first field."""

    header: Header = Header()


@dataclass(frozen=True, slots=True)
class ColorRGBA(Message, package="std_msgs"):
    """Each 0 to 1."""

    r: float = 0.0
    g: float = 0.0
    b: float = 0.0
    a: float = 1.0


class LeftOut:
    """A part of a message that iVeg leaves empty, whichever it is."""

    header = Header()
    format = filename = frame_id = ""
    height = width = 0
    data = np.zeros(0, np.uint8)


# --- geometry msgs ----------------------------------------------------------------
#
# Messages of ``geometry_msgs`` and ``tf2_msgs``: places, velocities and frames.

Covariance = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Point(Message, package="geometry_msgs"):
    """(m)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class Vector3(Message, package="geometry_msgs"):
    """(m), (m/s) or (rad/s)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True)
class Quaternion(Message, package="geometry_msgs"):
    """A rotation; the default is the identity."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


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

    transforms: Sequence[TransformStamped] = ()


# --- nav msgs ---------------------------------------------------------------------
#
# Messages of ``nav_msgs``: odometry, paths and maps.

Cells = NDArray[np.int8]


@dataclass(frozen=True, slots=True, eq=False)
class Odometry(Stamped, package="nav_msgs"):
    """Pose of ``child_frame_id`` in the header's frame; the twist in the child's."""

    child_frame_id: str = ""
    pose: PoseWithCovariance = field(default_factory=PoseWithCovariance)
    twist: TwistWithCovariance = field(default_factory=TwistWithCovariance)


@dataclass(frozen=True, slots=True)
class Path(Stamped, package="nav_msgs"):
    """Planned path of navigation."""

    poses: Sequence[PoseStamped] = ()


@dataclass(frozen=True, slots=True)
class MapMetaData(Message, package="nav_msgs"):
    """Size (m, cells) of a grid, and where its first cell begins."""

    map_load_time: Time = field(default_factory=Time)
    resolution: float = 0.0
    width: int = 0
    height: int = 0
    origin: Pose = field(default_factory=Pose)


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid(Stamped, package="nav_msgs"):
    """Costs row by row, 0 to 100; -1 unknown."""

    info: MapMetaData = MapMetaData()
    data: Cells = field(default_factory=lambda: np.zeros(0, np.int8))


# --- sensor msgs ------------------------------------------------------------------
#
# Messages of ``sensor_msgs``: scans, pictures, clouds and batteries.

Floats = NDArray[np.float32]


Doubles = NDArray[np.float64]


Octets = NDArray[np.uint8]


def _none() -> NDArray[np.float32]:
    return np.zeros(0, np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class LaserScan(Stamped, package="sensor_msgs"):
    """One sweep; ``ranges`` of shape (n,), (m)."""

    angle_min: float = 0.0
    angle_max: float = 0.0
    angle_increment: float = 0.0
    time_increment: float = 0.0
    scan_time: float = 0.0
    range_min: float = 0.0
    range_max: float = 0.0
    ranges: Floats = field(default_factory=_none)
    intensities: Floats = field(default_factory=_none)


@dataclass(frozen=True, slots=True, eq=False)
class BatteryState(Stamped, package="sensor_msgs"):
    """Volts, °C, amperes, ampere hours; ``percentage`` 0 to 1, NaN when unknown."""

    voltage: float = 0.0
    temperature: float = 0.0
    current: float = 0.0
    charge: float = 0.0
    capacity: float = 0.0
    design_capacity: float = 0.0
    percentage: float = 0.0
    power_supply_status: int = 0
    power_supply_health: int = 0
    power_supply_technology: int = 0
    present: bool = True
    cell_voltage: Floats = field(default_factory=_none)
    cell_temperature: Floats = field(default_factory=_none)
    location: str = ""
    serial_number: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Image(Stamped, package="sensor_msgs"):
    """Rows of ``step`` bytes each; depth pictures are ``16UC1`` (mm), ``32FC1`` (m)."""

    height: int = 0
    width: int = 0
    encoding: str = ""
    is_bigendian: int = 0
    step: int = 0
    data: Octets = field(default_factory=lambda: np.zeros(0, np.uint8))


@dataclass(frozen=True, slots=True)
class RegionOfInterest(Message, package="sensor_msgs"):
    """A part of a picture (pixels)."""

    x_offset: int = 0
    y_offset: int = 0
    height: int = 0
    width: int = 0
    do_rectify: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class CameraInfo(Stamped, package="sensor_msgs"):
    """Calibration of a camera; ``p`` is the projection of the rectified picture."""

    height: int = 0
    width: int = 0
    distortion_model: str = ""
    d: Doubles = field(default_factory=lambda: np.zeros(0))
    k: Doubles = field(default_factory=lambda: np.zeros(9))
    r: Doubles = field(default_factory=lambda: np.zeros(9))
    p: Doubles = field(default_factory=lambda: np.zeros(12))
    binning_x: int = 0
    binning_y: int = 0
    roi: RegionOfInterest = RegionOfInterest()


@dataclass(frozen=True, slots=True)
class PointField(Message, package="sensor_msgs"):
    """One field of each point; ``datatype`` 7 is float32."""

    name: str = ""
    offset: int = 0
    datatype: int = 7
    count: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class PointCloud2(Stamped, package="sensor_msgs"):
    """``width`` × ``height`` points of ``point_step`` bytes each."""

    height: int = 1
    width: int = 0
    fields: Sequence[PointField] = ()
    is_bigendian: bool = False
    point_step: int = 0
    row_step: int = 0
    data: Octets = field(default_factory=lambda: np.zeros(0, np.uint8))
    is_dense: bool = True


# --- visualization msgs -----------------------------------------------------------
#
# Messages of ``visualization_msgs``: shapes that RViz draws.


@dataclass(frozen=True, slots=True, eq=False)
class Marker(Stamped, package="visualization_msgs"):
    """A shape in RViz; ``type`` 3 is a cylinder, 9 a text."""

    ns: str = ""
    id: int = 0
    type: int = 0
    action: int = 0
    pose: Pose = field(default_factory=Pose)
    scale: Vector3 = field(default_factory=Vector3)
    color: ColorRGBA = field(default_factory=ColorRGBA)
    lifetime: Duration = field(default_factory=Duration)
    frame_locked: bool = False
    points: Sequence[Point] = ()
    colors: Sequence[ColorRGBA] = ()
    texture_resource: str = ""
    texture: Any = LeftOut
    uv_coordinates: Sequence[Any] = ()
    text: str = ""
    mesh_resource: str = ""
    mesh_file: Any = LeftOut
    mesh_use_embedded_materials: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class MarkerArray(Message, package="visualization_msgs"):
    """Shapes in RViz."""

    markers: Sequence[Marker] = ()


# --- vision msgs ------------------------------------------------------------------
#
# Messages of ``vision_msgs`` 4: what a detector found in a picture.


@dataclass(frozen=True, slots=True)
class ObjectHypothesis(Message, package="vision_msgs"):
    """Class hypothesis; ``score`` 0 to 1."""

    class_id: str = ""
    score: float = 0.0


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

    results: Sequence[ObjectHypothesisWithPose] = ()
    bbox: BoundingBox3D = BoundingBox3D()
    id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Detection3DArray(Stamped, package="vision_msgs"):
    """Detections of one picture, with depth."""

    detections: Sequence[Detection3D] = ()


@dataclass(frozen=True, slots=True)
class Point2D(Message, package="vision_msgs"):
    """(pixels)."""

    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class PicturePose(Message):
    """``vision_msgs/Pose2D``: pixels and a turn (rad)."""

    ROS: ClassVar[str] = "vision_msgs/msg/Pose2D"
    position: Point2D = Point2D()
    theta: float = 0.0


@dataclass(frozen=True, slots=True)
class BoundingBox2D(Message, package="vision_msgs"):
    """A box about its centre (pixels)."""

    center: PicturePose = PicturePose()
    size_x: float = 0.0
    size_y: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Detection2D(Stamped, package="vision_msgs"):
    """One object detected in a picture."""

    results: Sequence[ObjectHypothesisWithPose] = ()
    bbox: BoundingBox2D = BoundingBox2D()
    id: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Detection2DArray(Stamped, package="vision_msgs"):
    """Detections of one picture, without depth."""

    detections: Sequence[Detection2D] = ()
