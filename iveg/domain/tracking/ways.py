"""Ways on foot: how far it is from place to place, round the crop.

A visibility graph (Lozano-Pérez and Wesley 1979): the shortest way between two places
that do not see each other bends at corners of rows alone.
"""

import math

import numpy as np
from numpy.typing import NDArray

from iveg.domain.greenhouse import Greenhouse

_Floats = NDArray[np.float64]
_BESIDE_M = 0.3
"""So far from a corner one walks round it."""
_LEANS_IN_M = 0.15
"""So far into a row somebody may be placed who stands beside it."""
_MOST_CORNERS = 400
"""Of a larger plan ways are straight: to compare all corners takes too long."""


class Ways:
    """The shortest ways in a greenhouse, of which rows alone are in the way."""

    def __init__(self, greenhouse: Greenhouse) -> None:
        rows = np.array(
            [(r.xmin, r.ymin, r.xmax, r.ymax) for r in greenhouse.rows], np.float64
        ).reshape(-1, 4)
        self._corners = _corners(greenhouse, rows)
        if len(self._corners) > _MOST_CORNERS:
            rows, self._corners = rows[:0], self._corners[:0]
        self._rows = _shrunk(rows)
        self._between = self._all_pairs()

    def between(self, ax: float, ay: float, bx: float, by: float) -> float:
        """Length of the shortest way (m); ``inf``: there is none."""
        start, end = np.array([[ax, ay]]), np.array([[bx, by]])
        if self._sees(start, end)[0, 0]:
            return math.hypot(bx - ax, by - ay)
        if not len(self._corners):
            return math.inf
        ways = (
            self._legs(start, self._corners).T
            + self._between
            + self._legs(end, self._corners)
        )
        return float(ways.min())

    def _all_pairs(self) -> _Floats:
        """Between all corners (Floyd 1962)."""
        corners = self._corners
        legs = [self._legs(one[None], corners)[0] for one in corners]
        ways = np.array(legs).reshape(len(corners), len(corners))
        for over in range(len(ways)):
            np.minimum(ways, ways[:, over, None] + ways[over], out=ways)
        return ways

    def _legs(self, starts: _Floats, ends: _Floats) -> _Floats:
        away = np.hypot(*(ends[None] - starts[:, None]).transpose(2, 0, 1))
        legs: _Floats = np.where(self._sees(starts, ends), away, math.inf)
        return legs

    def _sees(self, starts: _Floats, ends: _Floats) -> NDArray[np.bool_]:
        """Whether no row lies between each start and each end (slab method)."""
        begin, span = starts[:, None, None], (ends[None] - starts[:, None])[:, :, None]
        span = np.where(span == 0.0, 1e-12, span)
        one = (self._rows[:, :2] - begin) / span
        two = (self._rows[:, 2:] - begin) / span
        enters = np.minimum(one, two).max(-1, initial=0.0)
        leaves = np.maximum(one, two).min(-1, initial=1.0)
        seen: NDArray[np.bool_] = (enters > leaves).all(-1)
        return seen


def _shrunk(rows: _Floats) -> _Floats:
    half = (rows[:, 2:] - rows[:, :2]) / 2
    less = np.minimum(_LEANS_IN_M, 0.9 * half)
    return np.hstack((rows[:, :2] + less, rows[:, 2:] - less))


def _corners(greenhouse: Greenhouse, rows: _Floats) -> _Floats:
    grown = rows + _BESIDE_M * np.array((-1.0, -1.0, 1.0, 1.0))
    corners = np.concatenate([grown[:, (x, y)] for x in (0, 2) for y in (1, 3)])
    kept = [
        greenhouse.bounds.contains(x, y)
        and not any(row.contains(x, y) for row in greenhouse.rows)
        for x, y in corners.tolist()
    ]
    free: _Floats = corners[np.array(kept, bool)]
    return free
