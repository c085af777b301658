"""Camera coverage: time since a camera last saw each cell of the aisles.

A map without people is evidence only for cells that were in view.  Aisles are divided
into cells.  A cell counts as seen when a live robot's camera would have seen a whole
person in its middle, with nothing in between (``sight.visible_from``).  The same view
may end a zone.  Recorded robots do not count.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from iveg.domain.greenhouse import DriveLane, Greenhouse
from iveg.domain.observations import Instant
from iveg.domain.robot_state import RobotState
from iveg.domain.tracking.sight import visible_from

CELL_M = 1.0
MOST_CELLS = 4000
"""Number of cells beyond which a greenhouse gets coarser cells, to bound the work."""
RECENT_S = 10.0
"""Age below which a view counts as present (s): the time that a zone lasts."""

_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class LaneCells:
    """Equal cells of one aisle: rows from the south, each from west to east.

    Attributes:
        columns: Number of cells from west to east; ``rows``: from south to north.
    """

    lane: DriveLane
    columns: int
    rows: int

    @property
    def count(self) -> int:
        """Number of cells."""
        return self.columns * self.rows

    def centres(self) -> _Floats:
        """Middles of the cells, shape (n, 2), in ``map`` (m)."""
        area = self.lane.area
        x = _middles(area.xmin, area.xmax, self.columns)
        y = _middles(area.ymin, area.ymax, self.rows)
        return np.column_stack((np.tile(x, self.rows), np.repeat(y, self.columns)))


class AisleCoverage:
    """Time at which each cell of a greenhouse was last in view."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        self._greenhouse = greenhouse
        self.lanes = _laid_out(greenhouse.lanes)
        parts = [lane.centres() for lane in self.lanes]
        self._centres = np.concatenate(parts) if parts else np.empty((0, 2))
        self._looked_at = np.full(len(self._centres), -np.inf)

    def update(self, robots: Iterable[RobotState], now: Instant) -> None:
        """Take the present views of these robots' cameras."""
        for robot in robots:
            seen = visible_from(robot, self._centres, self._greenhouse, now)
            self._looked_at[seen] = now.mono

    def ages(self, now: Instant) -> list[list[int | None]]:
        """Age of the newest view of each cell (whole s), by lane; None: never seen."""
        ages = (
            None if math.isinf(age) else max(0, int(age))
            for age in now.mono - self._looked_at
        )
        # Cells of all lanes are in a single array, lane after lane.
        return [list(islice(ages, lane.count)) for lane in self.lanes]

    def share(self, now: Instant) -> float | None:
        """Share of the cells seen within ``RECENT_S`` (0 to 1); None without aisles."""
        if not len(self._looked_at):
            return None
        return float(np.mean(now.mono - self._looked_at <= RECENT_S))


def _laid_out(lanes: tuple[DriveLane, ...]) -> tuple[LaneCells, ...]:
    area = sum(_size(lane)[0] * _size(lane)[1] for lane in lanes)
    side = max(CELL_M, math.sqrt(area / MOST_CELLS))
    return tuple(
        LaneCells(lane, *(max(1, math.ceil(size / side - 1e-9)) for size in sizes))
        for lane, sizes in ((lane, _size(lane)) for lane in lanes)
    )


def _size(lane: DriveLane) -> tuple[float, float]:
    area = lane.area
    return area.xmax - area.xmin, area.ymax - area.ymin


def _middles(low: float, high: float, count: int) -> _Floats:
    step = (high - low) / count
    return (low + step * (np.arange(count) + 0.5)).astype(np.float64)
