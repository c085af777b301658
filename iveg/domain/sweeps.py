"""What one scan says of each cell in its reach.

A cell is free if the beam in that direction went further, taken if it ended there.
Left out: beams are lines without width, and come from the nearest quarter of a cell.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import LaserScan
from iveg.domain.occupancy_grid import Cells, Grid, Numbers, overlap

_HIT, _MISS = 0.85, -0.4
_PARTS = 4
"""Of a cell along each axis: places that a sensor may have, each worked out once."""
_REACH_M = 15.0


@dataclass(frozen=True, slots=True)
class Sweep:
    """The evidence of one scan for the cells in its reach.

    Attributes:
        cells: Rows and columns that it speaks of.
        change: Shape of ``cells``; log-odds to add.
    """

    cells: Cells
    change: Numbers


def sweep_of(
    scan: LaserScan, pose: Pose2D, grid: Grid, returns: Numbers | None = None
) -> Sweep:
    """Read one scan, taken at ``pose`` in ``map``, cell by cell.

    Each cell looks up its beam, rather than each beam its cells, so that no holes
    remain between beams that are far apart.  ``returns``, shape (m, 2), (m): where
    beams ended in ``map``, where that is not in their middle.
    """
    sensor = pose.compose(scan.mount)
    reach = min(scan.range_max, _REACH_M)
    row, column = grid.index(sensor.x, sensor.y)
    around = math.ceil(reach / grid.resolution)
    cells = (
        overlap(row - around, 2 * around + 1, grid.height),
        overlap(column - around, 2 * around + 1, grid.width),
    )
    shape = cells[0].stop - cells[0].start, cells[1].stop - cells[1].start
    change = np.zeros(shape, np.float32)
    if change.size and scan.ranges.size:
        distance, bearing = _seen_from(grid, sensor, around)
        part = (
            slice(cells[0].start - row + around, cells[0].stop - row + around),
            slice(cells[1].start - column + around, cells[1].stop - column + around),
        )
        free_to = _free_to(scan, sensor.yaw, bearing[part], reach)
        free = distance[part] < free_to - np.float32(grid.resolution)
        np.multiply(free, np.float32(_MISS), out=change)
        points = scan.points(pose) if returns is None else returns
        rows, columns = _hits(points, sensor, grid, reach)
        inside = (rows >= cells[0].start) & (rows < cells[0].stop)
        inside &= (columns >= cells[1].start) & (columns < cells[1].stop)
        change[rows[inside] - cells[0].start, columns[inside] - cells[1].start] = _HIT
    return Sweep(cells, change)


def _seen_from(grid: Grid, sensor: Pose2D, around: int) -> tuple[Numbers, Numbers]:
    """Distances (m) and bearings (rad) of the cells around a sensor, about exactly."""
    x = (sensor.x - grid.xmin) / grid.resolution
    y = (sensor.y - grid.ymin) / grid.resolution
    parts = (math.floor((one - math.floor(one)) * _PARTS) for one in (x, y))
    return _cells_around(grid.resolution, around, *parts)


@lru_cache(maxsize=_PARTS * _PARTS)
def _cells_around(
    resolution: float, around: int, part_x: int, part_y: int
) -> tuple[Numbers, Numbers]:
    """Where cells are, from a sensor in that part of the cell in the middle.

    The angles of a hundred thousand cells cost more than all else in a sweep.
    """
    cells = np.arange(-around, around + 1, dtype=np.float32) + 0.5
    dx = (cells - (part_x + 0.5) / _PARTS)[None, :] * resolution
    dy = (cells - (part_y + 0.5) / _PARTS)[:, None] * resolution
    return (
        np.hypot(dx, dy).astype(np.float32),
        np.arctan2(dy, dx).astype(np.float32),
    )


def _free_to(scan: LaserScan, yaw: float, bearing: Numbers, reach: float) -> Numbers:
    """Length of the beam towards each cell (m); 0 where there is no beam."""
    step, first = scan.angle_increment, yaw + scan.angle_min
    turn = math.tau / abs(step)
    # A scan may turn either way.  Beams are counted from a bearing that no cell is
    # before, in the scan's own direction, and then less than two turns.
    side = math.copysign(math.pi, step)
    whole = math.copysign(math.tau, step)
    first -= whole * math.ceil((first + side) / whole)
    beam = bearing * np.float32(1.0 / step) - np.float32(first / step)
    beam -= (beam >= turn) * np.float32(turn)
    index = (beam + np.float32(0.5)).astype(np.intp)
    return _lengths(scan, math.ceil(turn) + 2, reach).take(index, mode="clip")


def _lengths(scan: LaserScan, size: int, reach: float) -> Numbers:
    """How far each beam of a turn went (m); 0 where there is none, or no use in it."""
    ranges, count = scan.ranges, scan.ranges.size
    usable = (ranges >= scan.range_min) | np.isinf(ranges)
    went = np.where(usable, np.minimum(ranges, reach), 0.0).astype(np.float32)
    if abs(count * scan.angle_increment) >= math.tau - 1.5 * abs(scan.angle_increment):
        return np.resize(went, size)  # all round: after the last comes the first
    lengths = np.zeros(size, np.float32)
    lengths[: min(count, size)] = went[:size]
    return lengths


def _hits(
    points: Numbers, sensor: Pose2D, grid: Grid, reach: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    points = points.astype(np.float64)
    near = np.hypot(points[:, 0] - sensor.x, points[:, 1] - sensor.y) <= reach
    points = points[near]
    column = np.floor((points[:, 0] - grid.xmin) / grid.resolution).astype(np.int64)
    row = np.floor((points[:, 1] - grid.ymin) / grid.resolution).astype(np.int64)
    return row, column
