"""Messages of ``nav_msgs``: odometry, paths and maps."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from iveg.ros2.geometry_msgs import (
    Pose,
    PoseStamped,
    PoseWithCovariance,
    TwistWithCovariance,
)
from iveg.ros2.schema import Float32, Many, Message, Uint32
from iveg.ros2.std_msgs import Stamped, Time

Cells = Annotated[NDArray[np.int8], Many("int8")]


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

    map_load_time: Time = field(default_factory=Time)
    resolution: Float32 = 0.0
    width: Uint32 = 0
    height: Uint32 = 0
    origin: Pose = field(default_factory=Pose)


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid(Stamped, package="nav_msgs"):
    """Costs row by row, 0 to 100; -1 unknown."""

    info: MapMetaData = MapMetaData()
    data: Cells = field(default_factory=lambda: np.zeros(0, np.int8))
