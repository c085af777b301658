"""Few cases that show every pair of values of different factors."""

from collections.abc import Mapping, Sequence
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

Case = dict[str, str]
_AGAIN = 1e-3
"""What a pair that was seen is worth: all others together less than a new one."""


def covering(factors: Mapping[str, Sequence[str]], at_least: int = 0) -> list[Case]:
    """Cases, greedily: next is the one with most pairs that none before has.

    Once every pair is there, further cases show the pairs that were seen least.

    Args:
        factors: The values of each.
        at_least: How many cases there shall be, though fewer would do.
    """
    cases = list(product(*factors.values()))
    pairs = _pairs_of(cases)
    seen = np.zeros(pairs.max() + 1)
    chosen: list[int] = []
    while len(chosen) < at_least or (seen == 0).any():
        worth = np.where(seen == 0, 1.0, _AGAIN / (1.0 + seen))
        gains = worth[pairs].sum(axis=1)
        gains[chosen] = -1.0
        best = int(gains.argmax())
        chosen.append(best)
        seen[pairs[best]] += 1
    return [dict(zip(factors, cases[n], strict=True)) for n in chosen]


def _pairs_of(cases: Sequence[tuple[str, ...]]) -> NDArray[np.intp]:
    """The numbers of the pairs that each case shows; shape (cases, pairs of a case)."""
    numbers: dict[tuple[int, str, int, str], int] = {}
    rows = [
        [
            numbers.setdefault((a, case[a], b, case[b]), len(numbers))
            for a, b in combinations(range(len(case)), 2)
        ]
        for case in cases
    ]
    return np.array(rows)
