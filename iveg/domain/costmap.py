"""Shared costmap: obstacles of the lasers, with the zones of people laid over.

Every scan judges each cell in its reach, free or taken (Moravec and Elfes' occupancy
grid, in log-odds with the clamps of OctoMap, so that a crate that is carried away is
soon forgotten).  Cells that no beam reaches any more fade to unknown.  People and peers
are laid over the grid with their zone at the moment of the request.

A ``Grid`` places the cells, and a ``Sweep`` is the evidence of one scan for those in
its reach: a cell is free if the beam in its direction went further, taken if the beam
ended there.  Simplification: a beam is a line without width.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.observations import LaserScan
from iveg.domain.rule.zones import Zone

RESOLUTION_M = 0.1
MAX_CELLS = 400_000
"""Number of cells beyond which a greenhouse gets coarser cells, to bound the work."""
Numbers = NDArray[np.float32]
Cells = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Grid:
    """Place of the cells in ``map``; row 0 is the southernmost.

    Attributes:
        resolution: Side of a cell (m).
        xmin: West edge (m); ``ymin`` south edge (m).
        width: Cells from west to east; ``height`` from south to north.
    """

    resolution: float
    xmin: float
    ymin: float
    width: int
    height: int

    @classmethod
    def over(cls, area: Rectangle) -> "Grid":
        """Grid over an area, with at most ``MAX_CELLS``."""
        wide, high = area.xmax - area.xmin, area.ymax - area.ymin
        coarse = math.ceil(math.sqrt(wide * high / MAX_CELLS) / RESOLUTION_M)
        side = RESOLUTION_M * max(1, coarse)
        # The epsilon keeps the last cell: 0.3 / 0.1 is 2.999... in floats.
        width, height = (max(1, math.floor(s / side + 1e-9)) for s in (wide, high))
        return cls(side, area.xmin, area.ymin, width, height)

    @property
    def area(self) -> Rectangle:
        """Area of all cells, in ``map`` (m)."""
        east = self.xmin + self.width * self.resolution
        north = self.ymin + self.height * self.resolution
        return Rectangle(self.xmin, self.ymin, east, north)

    def window(self, x: float, y: float, reach: float) -> Cells:
        """The cells within ``reach`` (m) of a point along both axes."""
        low = self.index(x - reach, y - reach)
        high = self.index(x + reach, y + reach)
        return (
            slice(max(0, low[0]), max(0, min(self.height, high[0] + 1))),
            slice(max(0, low[1]), max(0, min(self.width, high[1] + 1))),
        )

    def index(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of a point, which may lie outside."""
        return (
            math.floor((y - self.ymin) / self.resolution),
            math.floor((x - self.xmin) / self.resolution),
        )

    def offsets(self, cells: Cells, x: float, y: float) -> tuple[Numbers, Numbers]:
        """Offsets of cell centres from a point (m): dx, shape (1, n); dy, (m, 1)."""
        rows, columns = cells
        across = np.arange(columns.start, columns.stop, dtype=np.float32)
        up = np.arange(rows.start, rows.stop, dtype=np.float32)
        dx = (across + 0.5) * self.resolution + (self.xmin - x)
        dy = (up + 0.5) * self.resolution + (self.ymin - y)
        return dx.astype(np.float32)[None, :], dy.astype(np.float32)[:, None]


def overlap(start: int, size: int, limit: int) -> slice:
    """Part of ``size`` cells from ``start`` on that lies within 0 to ``limit``."""
    low = min(max(start, 0), limit)
    return slice(low, max(low, min(start + size, limit)))


_WINDOW_M, _WINDOW_MARGIN_M, _WINDOW_EDGE_M = 60.0, 20.0, 8.0


def window_round(poses: Sequence[Pose2D], before: Grid | None) -> Grid | None:
    """Grid around the robots where no walls are known, at most 60 m wide.

    It stays in place while every robot is well inside; ``before`` without robots.
    """
    x, y = [pose.x for pose in poses], [pose.y for pose in poses]
    if not x:
        return before
    west, east, south, north = min(x), max(x), min(y), max(y)
    if before is not None:
        area, inwards = before.area, -_WINDOW_EDGE_M
        holds_both = area.contains(west, south, inwards)
        if holds_both and area.contains(east, north, inwards):
            return before
    west, east = _stretch(west, east)
    south, north = _stretch(south, north)
    return Grid.over(Rectangle(west, south, east, north))


def _stretch(low: float, high: float) -> tuple[float, float]:
    """Bounds of the window along one axis (m), on whole metres so that cells meet."""
    half = min(_WINDOW_M, high - low + 2 * _WINDOW_MARGIN_M) / 2
    middle, half = round((low + high) / 2), math.ceil(half)
    return middle - half, middle + half


# OctoMap's log-odds of a hit and a miss (Hornung et al., 2013).
_HIT, _MISS = 0.85, -0.4
_REACH_M = 15.0


@dataclass(frozen=True, slots=True)
class Sweep:
    """Evidence of one scan for the cells in its reach.

    Attributes:
        cells: Rows and columns in reach.
        change: Log-odds to add, in the shape of ``cells``.
    """

    cells: Cells
    change: Numbers


def sweep_of(
    scan: LaserScan, pose: Pose2D, grid: Grid, returns: Numbers | None = None
) -> Sweep:
    """Evidence of one scan, taken at ``pose`` in ``map``.

    ``returns``: ends of the beams in ``map`` (m), shape (m, 2), where they are not in
    the middle of their beams.
    """
    # Each cell looks up its beam, so wide beams leave no holes between them.
    sensor = pose.compose(scan.mount)
    reach = min(scan.range_max, _REACH_M)
    cells = grid.window(sensor.x, sensor.y, reach)
    dx, dy = grid.offsets(cells, sensor.x, sensor.y)
    if not (dx.size and dy.size and scan.ranges.size):
        return Sweep(cells, np.zeros((dy.size, dx.size), np.float32))
    free_to = _free_to(scan, sensor.yaw, np.arctan2(dy, dx), reach)
    free = np.hypot(dx, dy) < free_to - np.float32(grid.resolution)
    change = np.where(free, np.float32(_MISS), np.float32(0.0))
    points = scan.points(pose) if returns is None else returns
    rows, columns = cells
    hit = _hits(points, sensor, grid, reach) - (rows.start, columns.start)
    hit = hit[((hit >= 0) & (hit < change.shape)).all(axis=1)]
    # Hits are written last: a cell with a return is taken, whatever passed through it.
    change[hit[:, 0], hit[:, 1]] = _HIT
    return Sweep(cells, change)


def _free_to(scan: LaserScan, yaw: float, bearing: Numbers, reach: float) -> Numbers:
    """Length of the beam towards each cell (m); 0 where there is no beam."""
    step, first = scan.angle_increment, yaw + scan.angle_min
    turn = math.tau / abs(step)
    # A scan may turn either way.  Beams are counted in the scan's own direction from a
    # bearing before all cells, so an index is less than two turns.
    side = math.copysign(math.pi, step)
    whole = math.copysign(math.tau, step)
    first -= whole * math.ceil((first + side) / whole)
    beam = bearing * np.float32(1.0 / step) - np.float32(first / step)
    beam -= (beam >= turn) * np.float32(turn)
    index = (beam + np.float32(0.5)).astype(np.intp)
    return _lengths(scan, math.ceil(turn) + 2, reach).take(index, mode="clip")


def _lengths(scan: LaserScan, size: int, reach: float) -> Numbers:
    """Length of each beam of a turn (m); 0 where there is none or it says nothing."""
    ranges, count = scan.ranges, scan.ranges.size
    went = np.where(scan.speaks(), np.minimum(ranges, reach), 0.0).astype(np.float32)
    if abs(count * scan.angle_increment) >= math.tau - 1.5 * abs(scan.angle_increment):
        return np.resize(went, size)  # a full turn: after the last beam the first
    lengths = np.zeros(size, np.float32)
    lengths[: min(count, size)] = went[:size]
    return lengths


def _hits(
    points: Numbers, sensor: Pose2D, grid: Grid, reach: float
) -> NDArray[np.int64]:
    """Row and column of each return within reach, shape (n, 2)."""
    x, y = points.astype(np.float64).T
    near = np.hypot(x - sensor.x, y - sensor.y) <= reach
    places = np.column_stack((y[near] - grid.ymin, x[near] - grid.xmin))
    return np.floor(places / grid.resolution).astype(np.int64)


UNKNOWN = -1
# OctoMap's clamps: evidence beyond them would outlast a crate that is carried away.
_LEAST, _MOST = -2.0, 3.5
_HALF_LIFE_S, _FADES_EVERY_S = 20.0, 0.25
_KNOWN = 0.05
"""Log-odds below which a cell counts as unknown, taken or free."""
_ZONE_EDGE, _ZONE_CENTRE = 50, 99


@dataclass(frozen=True, slots=True, eq=False)
class InflatedGrid:
    """Costs at one moment, as ``nav_msgs/OccupancyGrid``, with zones laid over.

    Attributes:
        data: Costs, shape (height, width): 0 free to 100 taken, -1 unknown.
    """

    grid: Grid
    data: NDArray[np.int8]


class Occupancy:
    """Log-odds of the cells of a grid: 0 unknown, below free, above taken.

    Args:
        half_life_s: Time in which log-odds fall to a half (s).
    """

    def __init__(self, grid: Grid, half_life_s: float = _HALF_LIFE_S) -> None:
        self.grid = grid
        self._half_life_s = half_life_s
        self._log: Numbers = np.zeros((grid.height, grid.width), np.float32)
        self._faded: float | None = None

    def add(self, sweep: Sweep) -> None:
        """Add the evidence of one scan."""
        part = self._log[sweep.cells]
        part += sweep.change
        np.clip(part, _LEAST, _MOST, out=part)

    def fade(self, mono: float) -> None:
        """Age the log-odds until ``mono`` (s), in steps of at least 0.25 s."""
        # Fading touches every cell, so it is not done for each scan.
        if self._faded is not None:
            elapsed_s = max(0.0, mono - self._faded)
            if elapsed_s < _FADES_EVERY_S:
                return
            self._log *= np.float32(0.5 ** (elapsed_s / self._half_life_s))
        self._faded = mono

    def moved_to(self, grid: Grid) -> "Occupancy":
        """Copy on another grid of the same resolution."""
        other = Occupancy(grid, self._half_life_s)
        other._faded = self._faded
        old = self.grid
        down, left = old.index(
            grid.xmin + old.resolution / 2, grid.ymin + old.resolution / 2
        )
        rows = overlap(down, grid.height, old.height)
        columns = overlap(left, grid.width, old.width)
        there = self._log[rows, columns]
        row, column = rows.start - down, columns.start - left
        other._log[row : row + there.shape[0], column : column + there.shape[1]] = there
        return other

    def costs(self, zones: Iterable[Zone] = ()) -> InflatedGrid:
        """Cost of each cell, with zones of people and peers laid over."""
        cost = np.clip(self._log * (100.0 / _MOST), 0.0, 100.0).astype(np.int8)
        cost[np.abs(self._log) < _KNOWN] = UNKNOWN
        for zone in zones:
            inflate(cost, self.grid, zone.x, zone.y, zone.radius_m)
        return InflatedGrid(self.grid, cost)


def inflate(
    cost: NDArray[np.int8], grid: Grid, x: float, y: float, radius_m: float
) -> None:
    """Lay one zone over the costs: dear at its edge, dearest at its centre."""
    cells = grid.window(x, y, radius_m)
    dx, dy = grid.offsets(cells, x, y)
    inward = 1.0 - np.hypot(dx, dy) / np.float32(radius_m)
    added = _ZONE_EDGE + (_ZONE_CENTRE - _ZONE_EDGE) * inward
    laid = np.where(inward >= 0.0, added, UNKNOWN).astype(np.int8)
    cost[cells] = np.maximum(cost[cells], laid)
