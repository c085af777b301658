"""What stands unchanged beside what the plan draws: "known here".

A plan that is off, plants that lean out and a pose that errs add up: then a row stands
a little farther out than the plan explains, and slows whoever passes it.  A cell of
``map`` is known once every look that had a line of sight found something in it, for
ten minutes.  It ends when somebody moves there, when it is seen empty, or with the day.

Nothing is learnt farther than half a metre from what is drawn: so somebody who stands
at a row for as long is seen by the part of the body that is farther out
(docs/safety.md, "The laser").
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Instant
from iveg.domain.witness import PLAN_M, KnownBody, Plan

STANDS_S = 600.0
FROM_PLAN_M = 0.5
CELL_M = 0.25
MOST_CELLS = 1024
UNSEEN_S = 150.0
"""After a longer time without a look nobody knows what stood there in between."""
_REACH_M = 4.0
"""Farther beams are too far apart to find a cell empty."""
_STANDS_FROM_M = 0.3
"""A pose that errs by 0.1 m does not make a thing disappear; a row is no such thing."""
_MOVER_M = 0.4
"""About the middle of somebody: half of a person, and half a cell."""
_DAY_S = 86_400.0

_Floats = NDArray[np.float64]
_Flags = NDArray[np.bool_]
Cell = tuple[int, int]


@dataclass(slots=True)
class _Stay:
    """Since when something stood in a cell in every look, and the newest (s)."""

    since: float
    at: float

    @property
    def is_known(self) -> bool:
        return self.at - self.since >= STANDS_S


class KnownHere:
    """The cells in which something stands for long, by the looks of all robots.

    Args:
        plan: What is drawn; of a greenhouse of walls alone nothing is learnt.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._cells: dict[Cell, _Stay] = {}
        self._day = -math.inf

    @property
    def places(self) -> Sequence[tuple[float, float]]:
        """The middle of each cell that is known (m)."""
        return [_middle(cell) for cell, stay in self._cells.items() if stay.is_known]

    def explains(self, x: _Floats, y: _Floats) -> _Flags:
        """Which returns, shape (n,) in ``map``, are of what is known here."""
        stays = (self._cells.get(cell) for cell in _cells_of(x, y))
        here = np.array([one is not None and one.is_known for one in stays], np.bool_)
        if here.any():
            here[here] = self._plan.distance_to(x[here], y[here]) <= FROM_PLAN_M
        return here

    def moved(self, places: Iterable[tuple[float, float]]) -> None:
        """Somebody is, or walks, here: what stands there has to be learnt anew."""
        for x, y in places:
            for cell in list(self._cells):
                if math.dist(_middle(cell), (x, y)) <= _MOVER_M:
                    del self._cells[cell]

    def learn(
        self, points: _Floats, sensor: Pose2D, bodies: Sequence[KnownBody], now: Instant
    ) -> None:
        """Take one look.

        Args:
            points: All returns of a scan, shape (n, 2), in ``map`` (m).
            sensor: Where it was made.
            bodies: Peers and people: where they are nothing is learnt.
            now: When it was made.
        """
        self._expire(now)
        if not self._plan.is_drawn:
            return
        away = np.hypot(points[:, 0] - sensor.x, points[:, 1] - sensor.y)
        near = points[away <= _REACH_M + 2 * CELL_M]
        apart = self._plan.distance_to(near[:, 0], near[:, 1])
        self._look_again(points, near[apart > _STANDS_FROM_M], sensor, bodies, now.mono)
        strange = near[(apart > PLAN_M) & (apart <= FROM_PLAN_M)]
        for cell in _cells_of(*strange.T):
            is_free = not _is_of(bodies, cell) and len(self._cells) < MOST_CELLS
            if is_free and math.dist(_middle(cell), (sensor.x, sensor.y)) <= _REACH_M:
                self._cells.setdefault(cell, _Stay(now.mono, now.mono))

    def _expire(self, now: Instant) -> None:
        """Forget all with the day (UTC), and what nobody looked at while learning."""
        day = now.wall // _DAY_S
        if day != self._day:
            self._cells.clear()
            self._day = day
        for cell, stay in list(self._cells.items()):
            if not stay.is_known and now.mono - stay.at > UNSEEN_S:
                del self._cells[cell]

    def _look_again(
        self,
        points: _Floats,
        standing: _Floats,
        sensor: Pose2D,
        bodies: Sequence[KnownBody],
        now: float,
    ) -> None:
        """See whether what stood in each cell within reach still does."""
        here = sensor.x, sensor.y
        for cell in list(self._cells):
            x, y = middle = _middle(cell)
            if math.dist(middle, here) > _REACH_M or _is_of(bodies, cell):
                continue
            if np.any(np.hypot(standing[:, 0] - x, standing[:, 1] - y) <= CELL_M):
                self._cells[cell].at = now
            elif _is_seen_through(points, sensor, x, y):
                del self._cells[cell]


def _middle(cell: Cell) -> tuple[float, float]:
    return (cell[0] + 0.5) * CELL_M, (cell[1] + 0.5) * CELL_M


def _cells_of(x: _Floats, y: _Floats) -> Iterator[Cell]:
    """The cell of each point, shape (n,)."""
    columns, rows = (np.floor(one / CELL_M).astype(int).tolist() for one in (x, y))
    return zip(columns, rows, strict=True)


def _is_of(bodies: Sequence[KnownBody], cell: Cell) -> bool:
    """Whether what is in a cell may be somebody who is known."""
    x, y = _middle(cell)
    reach = (one.radius + CELL_M - math.hypot(one.x - x, one.y - y) for one in bodies)
    return max(reach, default=-1.0) >= 0.0


def _is_seen_through(points: _Floats, sensor: Pose2D, x: float, y: float) -> bool:
    """Whether a beam through the middle of a cell ends behind it."""
    away = math.hypot(x - sensor.x, y - sensor.y)
    if away < CELL_M:
        return False
    toward_x, toward_y = (x - sensor.x) / away, (y - sensor.y) / away
    dx, dy = points[:, 0] - sensor.x, points[:, 1] - sensor.y
    along, across = dx * toward_x + dy * toward_y, np.abs(dx * toward_y - dy * toward_x)
    through = (along > away + CELL_M) & (across * away <= along * CELL_M / 2)
    return bool(through.any())
