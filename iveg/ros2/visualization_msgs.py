"""Messages of ``visualization_msgs``: shapes that RViz draws."""

from dataclasses import dataclass, field

import numpy as np

from iveg.ros2.geometry_msgs import Point, Pose, Vector3
from iveg.ros2.schema import Boolean, Float32, Int32, Message
from iveg.ros2.sensor_msgs import CompressedImage, Octets
from iveg.ros2.std_msgs import ColorRGBA, Duration, Stamped


@dataclass(frozen=True, slots=True)
class UVCoordinate(Message, package="visualization_msgs"):
    """A part of ``Marker`` that iVeg leaves empty."""

    u: Float32 = 0.0
    v: Float32 = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MeshFile(Message, package="visualization_msgs"):
    """A part of ``Marker`` that iVeg leaves empty."""

    filename: str = ""
    data: Octets = field(default_factory=lambda: np.zeros(0, np.uint8))


@dataclass(frozen=True, slots=True, eq=False)
class Marker(Stamped, package="visualization_msgs"):
    """A shape in RViz; ``type`` 3 is a cylinder, 9 a text."""

    ns: str = ""
    id: Int32 = 0
    type: Int32 = 0
    action: Int32 = 0
    pose: Pose = field(default_factory=Pose)
    scale: Vector3 = field(default_factory=Vector3)
    color: ColorRGBA = field(default_factory=ColorRGBA)
    lifetime: Duration = field(default_factory=Duration)
    frame_locked: Boolean = False
    points: tuple[Point, ...] = ()
    colors: tuple[ColorRGBA, ...] = ()
    texture_resource: str = ""
    texture: CompressedImage = field(default_factory=CompressedImage)
    uv_coordinates: tuple[UVCoordinate, ...] = ()
    text: str = ""
    mesh_resource: str = ""
    mesh_file: MeshFile = field(default_factory=MeshFile)
    mesh_use_embedded_materials: Boolean = False


@dataclass(frozen=True, slots=True, eq=False)
class MarkerArray(Message, package="visualization_msgs"):
    """Shapes in RViz."""

    markers: tuple[Marker, ...] = ()
