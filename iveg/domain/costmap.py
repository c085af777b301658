"""The shared costmap: obstacles that lasers found, with the rings of people laid over.

Every scan judges each cell in its reach, free or taken (Moravec and Elfes' occupancy
grid, in log-odds with the clamps of OctoMap, so that a crate that is carried away is
soon forgotten).  Cells that no beam reaches any more fade to unknown.  People and peers
are laid over the grid with their ring at the moment of the request.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.occupancy_grid import Grid, Numbers, overlap
from iveg.domain.rule.zones import Zone
from iveg.domain.sweeps import Sweep

UNKNOWN = -1
_LEAST, _MOST = -2.0, 3.5
_HALF_LIFE_S, _FADES_EVERY_S = 20.0, 0.25
_KNOWN = 0.05
"""Log-odds nearer to zero than this say nothing."""
_RING_EDGE, _RING_CENTRE = 50, 99


@dataclass(frozen=True, slots=True, eq=False)
class InflatedGrid:
    """Costs at one moment: ``nav_msgs/OccupancyGrid`` with its rings inflated.

    Attributes:
        data: Shape (height, width), int8; 0 free to 100 taken, -1 unknown.
    """

    grid: Grid
    data: NDArray[np.int8]


class Occupancy:
    """Log-odds of one grid: 0 unknown, below free, above taken.

    Args:
        half_life_s: In so long half of what is known is forgotten (s).
    """

    def __init__(self, grid: Grid, half_life_s: float = _HALF_LIFE_S) -> None:
        self.grid = grid
        self._half_life_s = half_life_s
        self._log: Numbers = np.zeros((grid.height, grid.width), np.float32)
        self._faded: float | None = None

    def add(self, sweep: Sweep) -> None:
        """Take one scan in."""
        part = self._log[sweep.cells]
        part += sweep.change
        np.clip(part, _LEAST, _MOST, out=part)

    def fade(self, mono: float) -> None:
        """Let what is known age until ``mono`` (s), or almost."""
        if self._faded is not None:
            passed = max(0.0, mono - self._faded)
            if passed < _FADES_EVERY_S:
                return
            self._log *= np.float32(0.5 ** (passed / self._half_life_s))
        self._faded = mono

    def moved_to(self, grid: Grid) -> "Occupancy":
        """The same knowledge on a grid of the same resolution that lies elsewhere."""
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
        """What each cell costs, rings of people and peers laid over it."""
        cost = np.clip(self._log * (100.0 / _MOST), 0.0, 100.0).astype(np.int8)
        cost[np.abs(self._log) < _KNOWN] = UNKNOWN
        for zone in zones:
            inflate(cost, self.grid, zone.x, zone.y, zone.radius_m)
        return InflatedGrid(self.grid, cost)


def inflate(
    cost: NDArray[np.int8], grid: Grid, x: float, y: float, radius_m: float
) -> None:
    """Lay one ring over the costs: dear at its edge, dearest at its centre."""
    cells = grid.window(x, y, radius_m)
    dx, dy = grid.offsets(cells, x, y)
    inward = 1.0 - np.hypot(dx, dy) / np.float32(radius_m)
    added = _RING_EDGE + (_RING_CENTRE - _RING_EDGE) * inward
    laid = np.where(inward >= 0.0, added, UNKNOWN).astype(np.int8)
    cost[cells] = np.maximum(cost[cells], laid)
