"""Messages of ``sensor_msgs``: scans, pictures, clouds and batteries."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from iveg.ros2.schema import Boolean, Float32, Many, Message, Uint8, Uint32
from iveg.ros2.std_msgs import Stamped

Floats = Annotated[NDArray[np.float32], Many("float32")]


Doubles = Annotated[NDArray[np.float64], Many("float64")]


Octets = Annotated[NDArray[np.uint8], Many("uint8")]


Nine = Annotated[NDArray[np.float64], Many("float64", 9)]


Twelve = Annotated[NDArray[np.float64], Many("float64", 12)]


def _none() -> NDArray[np.float32]:
    return np.zeros(0, np.float32)


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
