"""Scans: ranges and header to one sweep, field for field ``sensor_msgs/LaserScan``."""

import math
from array import array
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import LaserScan, Origin
from iveg.ngsi import names, payloads
from iveg.ngsi.codec.fields import read_origin, refuse_unplaced

_BASE_LINK = Pose2D(0.0, 0.0, 0.0)
_LIDAR_POINTS: TypeAdapter[list[float | None]] = TypeAdapter(payloads.LidarPoints)
_TURN = math.tau + 0.1
"""Drivers close their turn with a beam or two more (rad)."""
_FINEST = 1e-4
"""No laser is finer (rad); whoever draws a turn of beams needs room for each."""


def read_scan(robot_id: str, attributes: Mapping[str, object]) -> LaserScan:
    """Read ``lidar_points`` and its header."""
    refuse_unplaced(attributes.get(names.LIDAR_HEADER))
    return _scan_of(robot_id, attributes[names.LIDAR], attributes.get("lidar_header"))


def _scan_of(robot_id: str, points: object, raw_header: object) -> LaserScan:
    ranges = _ranges(points)
    if raw_header is None:
        return LaserScan(
            robot_id,
            Origin(),
            angle_min=-np.pi,
            angle_increment=2 * np.pi / max(1, ranges.size),
            range_min=0.0,
            range_max=1e4,
            mount=_BASE_LINK,
            ranges=ranges,
        )
    header = payloads.LidarHeaderValue.model_validate(raw_header)
    _refuse_impossible(header, ranges.size)
    return LaserScan(
        robot_id,
        read_origin(header),
        header.angle_min,
        # The one beam of a scan needs none, but whoever draws it does.
        header.angle_increment if ranges.size > 1 else _FINEST,
        header.range_min,
        header.range_max,
        Pose2D(header.x, header.y, header.yaw),
        ranges,
    )


def _ranges(points: object) -> NDArray[np.float32]:
    """A scan's numbers as one buffer; inf where nothing came back.

    Raises:
        ValidationError: not a list of at most 4,096 numbers and nulls in range.
    """
    buffer = compact(points)
    if isinstance(buffer, np.ndarray):
        return buffer
    return ranges_of(_LIDAR_POINTS.validate_python(points))


def ranges_of(points: list[float | None]) -> NDArray[np.float32]:
    """Numbers of a scan (m); inf where nothing came back."""
    ranges = np.array(points, np.float32)
    ranges[np.isnan(ranges)] = np.inf
    return ranges


def compact(points: object) -> object:
    """Numbers as one buffer where nothing has to be judged; else what was given.

    That is: no null, no bool, all in range.  Hundreds of Python's numbers would have
    left the processor's cache when the scan is drawn.
    """
    if type(points) is not list or not 0 < len(points) <= payloads.MAX_BEAMS:
        return points
    try:
        numbers = np.frombuffer(array("d", points))
    except (TypeError, OverflowError):
        return points
    # A bool looks like 0 or 1 here.  "Not" also refuses NaN, which no JSON has.
    if not (numbers.min() >= 0.0 and numbers.max() <= payloads.MAX_RANGE_M):
        return points
    if np.any(numbers == 0.0) or np.any(numbers == 1.0):
        return points
    return numbers.astype(np.float32)


def _refuse_impossible(header: payloads.LidarHeaderValue, beams: int) -> None:
    """Refuse a sweep that no laser makes.

    Raises:
        UnreadableError: its beams do not turn, turn more than once, or count nothing.
    """
    increment = header.angle_increment
    if abs(increment) < _FINEST and beams > 1:
        raise UnreadableError("bad_lidar_header", "angle_increment is 0 or nearly so")
    if abs(increment) * (beams - 1) > _TURN:
        raise UnreadableError("bad_lidar_header", "beams turn more than once round")
    if not 0.0 <= header.range_min < header.range_max:
        raise UnreadableError("bad_lidar_header", "range_min is not below range_max")


def read_single_scan(robot_id: str, attributes: Mapping[str, object]) -> LaserScan:
    """Read the sweep of Algorithm 1's payload."""
    return _scan_of(robot_id, attributes["laser_scan"], attributes.get("lidar_header"))
