"""Global assignment: as many pairs as can be, and of those the cheapest in sum.

The Hungarian method by shortest augmenting paths with potentials (Kuhn 1955; Jonker and
Volgenant 1987), O(n^3); pictures hold few people, so n is small.
"""

import math
from collections.abc import Sequence

_NEVER = 1e9
"""Stands for a pair that cannot be; far above any sum of distances (m)."""


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
    if len(costs) > len(costs[0]):
        flipped = assign([list(column) for column in zip(*costs, strict=True)])
        return sorted((row, column) for column, row in flipped)
    finite = [[min(cost, _NEVER) for cost in row] for row in costs]
    columns = _columns_of_rows(finite)
    return [
        (row, column)
        for row, column in enumerate(columns)
        if math.isfinite(costs[row][column])
    ]


def _undisputed(costs: Sequence[Sequence[float]]) -> list[tuple[int, int]] | None:
    """The pairs where no row has a choice and no two want one column; else None.

    So it is nearly always: each person in a picture is near one place.
    """
    pairs = []
    for row, offers in enumerate(costs):
        columns = [column for column, cost in enumerate(offers) if cost < _NEVER]
        if len(columns) > 1:
            return None
        pairs += [(row, column) for column in columns]
    taken = {column for _, column in pairs}
    return pairs if len(taken) == len(pairs) else None


def _columns_of_rows(costs: Sequence[Sequence[float]]) -> list[int]:
    """The column of each row; there are at least as many columns as rows.

    Column 0 and row 0 are virtual; real ones count from 1.
    """
    rows, columns = len(costs), len(costs[0])
    row_potential = [0.0] * (rows + 1)
    column_potential = [0.0] * (columns + 1)
    row_of = [0] * (columns + 1)
    for row in range(1, rows + 1):
        row_of[0] = row
        way = _shortest_way(costs, row_of, row_potential, column_potential)
        _flip(way, row_of)
    out = [0] * rows
    for column in range(1, columns + 1):
        if row_of[column]:
            out[row_of[column] - 1] = column - 1
    return out


def _shortest_way(
    costs: Sequence[Sequence[float]],
    row_of: Sequence[int],
    row_potential: list[float],
    column_potential: list[float],
) -> list[int]:
    """From the new row in column 0 to a free column; the last entry is that column."""
    columns = len(row_of) - 1
    least = [math.inf] * (columns + 1)
    before = [0] * (columns + 1)
    used = [False] * (columns + 1)
    column = 0
    while row_of[column]:
        used[column] = True
        row, delta, nearest = row_of[column], math.inf, 0
        for other in range(1, columns + 1):
            if used[other]:
                continue
            reduced = (
                costs[row - 1][other - 1] - row_potential[row] - column_potential[other]
            )
            if reduced < least[other]:
                least[other], before[other] = reduced, column
            if least[other] < delta:
                delta, nearest = least[other], other
        for other in range(columns + 1):
            if used[other]:
                row_potential[row_of[other]] += delta
                column_potential[other] -= delta
            else:
                least[other] -= delta
        column = nearest
    before[0] = column
    return before


def _flip(before: Sequence[int], row_of: list[int]) -> None:
    """Give every row on the way the next column."""
    column = before[0]
    while column:
        previous = before[column]
        row_of[column] = row_of[previous]
        column = previous
