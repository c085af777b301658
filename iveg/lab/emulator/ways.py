"""Ways through the greenhouse: A* on a grid, straightened where nothing is between.

Source: Hart, Nilsson, Raphael 1968; eight neighbours, Euclidean steps.  Left out: what
moves, and turning radii: a way may turn on the spot.
"""

import heapq
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from iveg.lab.emulator.greenhouse import Scenery

_CELL_M = 0.25
_MARGINS_M = (0.4, 0.1)
"""Tried one after the other beside half the robot's width (m)."""
_SNAP_M = 0.75
_Cell = tuple[int, int]
_Place = tuple[float, float]
_STEPS = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))


def way_between(
    start: _Place, goal: _Place, scenery: Scenery, half_width_m: float
) -> list[_Place] | None:
    """Corners of a way for a robot of this width; None where there is none."""
    for margin_m in _MARGINS_M:
        grid = _Grid(scenery, half_width_m + margin_m)
        way = grid.way(start, goal)
        if way is not None:
            return way
    return None


class _Grid:
    """Where the middle of a robot may be."""

    def __init__(self, scenery: Scenery, keep_off_m: float) -> None:
        bounds = scenery.bounds
        self._origin = bounds.xmin, bounds.ymin
        xs = np.arange(bounds.xmin, bounds.xmax, _CELL_M) + _CELL_M / 2
        ys = np.arange(bounds.ymin, bounds.ymax, _CELL_M) + _CELL_M / 2
        x, y = np.meshgrid(xs, ys, indexing="ij")
        away = np.minimum.reduce(
            (x - bounds.xmin, bounds.xmax - x, y - bounds.ymin, bounds.ymax - y)
        )
        for xmin, ymin, xmax, ymax in scenery.rectangles:
            dx = np.maximum(np.maximum(xmin - x, x - xmax), 0.0)
            dy = np.maximum(np.maximum(ymin - y, y - ymax), 0.0)
            away = np.minimum(away, np.hypot(dx, dy))
        for px, py, radius in scenery.posts:
            away = np.minimum(away, np.hypot(x - px, y - py) - radius)
        self._free: NDArray[np.bool_] = away > keep_off_m

    def way(self, start: _Place, goal: _Place) -> list[_Place] | None:
        """Corners from one place to another; None where nothing leads there."""
        first, last = self._free_cell(start), self._free_cell(goal)
        if first is None or last is None:
            return None
        cells = self._search(first, last)
        if cells is None:
            return None
        middle = [self._middle(one) for one in self._straight(cells)]
        corners = [start, *middle[1:-1], goal]
        return [a for a, b in zip(corners, [*corners[1:], None], strict=True) if a != b]

    def _free_cell(self, place: _Place) -> _Cell | None:
        """The free cell nearest to a place, within 0.75 m."""
        cells = np.argwhere(self._free)
        if not len(cells):
            return None
        centres = cells * _CELL_M + _CELL_M / 2 + np.array(self._origin)
        away = np.hypot(centres[:, 0] - place[0], centres[:, 1] - place[1])
        nearest = int(away.argmin())
        if away[nearest] > _SNAP_M:
            return None
        return int(cells[nearest][0]), int(cells[nearest][1])

    def _middle(self, cell: _Cell) -> _Place:
        x, y = self._origin
        return x + (cell[0] + 0.5) * _CELL_M, y + (cell[1] + 0.5) * _CELL_M

    def _search(self, first: _Cell, last: _Cell) -> list[_Cell] | None:
        cost, came_from = {first: 0.0}, {first: first}
        queue = [(math.dist(first, last), first)]
        done: set[_Cell] = set()
        while queue:
            cell = heapq.heappop(queue)[1]
            if cell == last:
                return list(_back(came_from, last))[::-1]
            if cell in done:
                continue
            done.add(cell)
            for i, j in _STEPS:
                near = cell[0] + i, cell[1] + j
                far = cost[cell] + math.hypot(i, j)
                if self._is_free(near) and far < cost.get(near, math.inf):
                    cost[near], came_from[near] = far, cell
                    heapq.heappush(queue, (far + math.dist(near, last), near))
        return None

    def _is_free(self, cell: _Cell) -> bool:
        inside = (
            0 <= cell[0] < self._free.shape[0] and 0 <= cell[1] < (self._free.shape[1])
        )
        return inside and bool(self._free[cell])

    def _straight(self, cells: list[_Cell]) -> list[_Cell]:
        """The cells where the way has to turn."""
        kept, at = [cells[0]], 0
        while at < len(cells) - 1:
            seen = (
                n for n in range(len(cells) - 1, at, -1) if self._sees(cells, at, n)
            )
            at = next(seen, at + 1)
            kept.append(cells[at])
        return kept

    def _sees(self, cells: list[_Cell], one: int, other: int) -> bool:
        (ax, ay), (bx, by) = cells[one], cells[other]
        steps = 2 * max(abs(bx - ax), abs(by - ay), 1)
        along = np.linspace(0.0, 1.0, steps + 1)
        x = np.rint(ax + (bx - ax) * along).astype(int)
        y = np.rint(ay + (by - ay) * along).astype(int)
        return bool(self._free[x, y].all())


def _back(came_from: dict[_Cell, _Cell], cell: _Cell) -> Iterator[_Cell]:
    while True:
        yield cell
        if came_from[cell] == cell:
            return
        cell = came_from[cell]
