"""Positions of many things as columns, for a quick search of what is near.

Every key (a person) has a few spots (sightings).  A search returns keys that *may* be
near; the caller judges those by the exact rule.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Spot = tuple[float, float, float, float]
"""x, y (m), moment (monotonic, s), reach (m, of a doubtful place; else 0)."""

_NOWHERE: Spot = (np.inf, np.inf, 0.0, 0.0)


class PointIndex:
    """Positions of all sightings.

    Attributes:
        columns: Shape (4, n): x, y, moment and reach; x is infinite in empty columns.
        owners: Of each column its key.
    """

    def __init__(self) -> None:
        self.columns: Floats = np.empty((4, 0))
        self._free: list[int] = []
        self._rows: dict[str, list[int]] = {}
        self.owners: list[str] = []

    def put(self, key: str, spots: Sequence[Spot]) -> None:
        """Keep a key's spots in place of those it had."""
        rows = self._rows.setdefault(key, [])
        while len(rows) > len(spots):
            self._empty(rows.pop())
        while len(rows) < len(spots):
            if not self._free:
                self._grow()
            rows.append(self._free.pop())
            self.owners[rows[-1]] = key
        for row, spot in zip(rows, spots, strict=True):
            self.columns[:, row] = spot

    def remove(self, key: str) -> None:
        """Forget a key."""
        for row in self._rows.pop(key, ()):
            self._empty(row)

    def _empty(self, row: int) -> None:
        self.columns[:, row] = _NOWHERE
        self._free.append(row)

    def _grow(self) -> None:
        size = len(self.owners)
        more = max(32, size)
        fresh = np.tile(np.array(_NOWHERE)[:, None], (1, more))
        self.columns = np.hstack((self.columns, fresh))
        self.owners += [""] * more
        self._free += range(size + more - 1, size - 1, -1)
