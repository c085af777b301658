"""A grid over ``map``: where its cells lie."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Rectangle

RESOLUTION_M = 0.1
MAX_CELLS = 400_000
"""A larger greenhouse gets coarser cells, so that none costs more than this."""
Numbers = NDArray[np.float32]
Cells = tuple[slice, slice]


@dataclass(frozen=True, slots=True)
class Grid:
    """Where the cells lie in ``map``; row 0 is the southernmost.

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
        """The grid that covers an area with at most ``MAX_CELLS``."""
        wide, high = area.xmax - area.xmin, area.ymax - area.ymin
        coarse = math.ceil(math.sqrt(wide * high / MAX_CELLS) / RESOLUTION_M)
        side = RESOLUTION_M * max(1, coarse)
        width, height = (max(1, math.floor(s / side + 1e-9)) for s in (wide, high))
        return cls(side, area.xmin, area.ymin, width, height)

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
        """From a point to the centres of cells: dx shape (1, n), dy (m, 1), (m)."""
        rows, columns = cells
        across = np.arange(columns.start, columns.stop, dtype=np.float32)
        up = np.arange(rows.start, rows.stop, dtype=np.float32)
        dx = (across + 0.5) * self.resolution + (self.xmin - x)
        dy = (up + 0.5) * self.resolution + (self.ymin - y)
        return dx.astype(np.float32)[None, :], dy.astype(np.float32)[:, None]


def overlap(start: int, size: int, limit: int) -> slice:
    """Where ``size`` cells from ``start`` on meet the cells 0 to ``limit``."""
    low = min(max(start, 0), limit)
    return slice(low, max(low, min(start + size, limit)))
