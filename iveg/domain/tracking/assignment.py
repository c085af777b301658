"""Global assignment: as many pairs as can be, and of those the cheapest in sum.

The Hungarian method by shortest augmenting paths with potentials (Kuhn 1955; Jonker and
Volgenant 1987), O(n^3); pictures hold few people, so n is small.
"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_NEVER = 1e9
"""Stands for a pair that cannot be; far above any sum of distances (m)."""
_PLAINLY = 1e-3
"""So much cheaper (m) is cheaper, however sums beside ``_NEVER`` are rounded."""
_FREE = -1


def assign(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]]:
    """Pair rows with columns.

    Args:
        costs: Shape (rows, columns); ``inf`` where a pair cannot be.

    Returns:
        Pairs (row, column) in the order of rows, each row and column once at most.
    """
    if not costs or not costs[0]:
        return []
    plain = _undisputed(costs)
    if plain is not None:
        return plain
    table = np.minimum(np.array(costs), _NEVER)
    if len(costs) > len(costs[0]):
        pairs = sorted((row, column) for column, row in _matched(table.T))
    else:
        pairs = _matched(table)
    return [(row, column) for row, column in pairs if math.isfinite(costs[row][column])]


def _undisputed(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]] | None:
    """The pairs where each row has what is plainly its cheapest, no two the same.

    Else None.  No other pairs are as many and as cheap: a row that had another column,
    or none, would cost more.  So it is nearly always: each person in a picture is near
    one place.
    """
    pairs = []
    for row, offers in enumerate(costs):
        least = min(offers)
        if least >= _NEVER:
            continue
        if sum([cost < least + _PLAINLY for cost in offers]) > 1:
            return None
        pairs.append((row, offers.index(least)))
    taken = {column for _, column in pairs}
    return pairs if len(taken) == len(pairs) else None


def _matched(costs: NDArray[np.float64]) -> list[tuple[int, int]]:
    """The column of each row; there are at least as many columns as rows."""
    rows, columns = costs.shape
    row_potential, column_potential = np.zeros(rows), np.zeros(columns)
    row_of, column_of = np.full(columns, _FREE), np.full(rows, _FREE)
    for new in range(rows):
        least, before = np.full(columns, math.inf), np.full(columns, _FREE)
        reached, done = [], np.zeros(columns, np.bool_)
        row, length = new, 0.0
        while row != _FREE:
            reached.append(row)
            reduced = length + costs[row] - row_potential[row] - column_potential
            nearer = ~done & (reduced < least)
            least[nearer], before[nearer] = reduced[nearer], row
            column = int(np.where(done, math.inf, least).argmin())
            length, done[column] = float(least[column]), True
            row = int(row_of[column])
        row_potential[new] += length
        earlier = reached[1:]
        row_potential[earlier] += length - least[column_of[earlier]]
        column_potential[done] -= length - least[done]
        while column != _FREE:  # every row on the way takes the next column
            row = int(before[column])
            row_of[column] = row
            column_of[row], column = column, int(column_of[row])
    return [(row, int(column)) for row, column in enumerate(column_of)]
