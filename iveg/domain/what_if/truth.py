"""Slowing held against the truth: who was missed, who slowed for nobody."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from iveg.domain.what_if.inputs import Flags, Floats

NEAR_M: Final = 2.0
"""Whoever is so near a robot that drives must slow it (m)."""
AWAY_M: Final = 2.3
"""With nobody so near slowing for people is a false alarm (m)."""
_LASTS_S: Final = 0.5


@dataclass(frozen=True, slots=True)
class Nearest:
    """How near the nearest person really was to a robot, oldest first; shape (n,).

    Attributes:
        at: Unix seconds; ``away`` from the robot's ``base_link`` (m), inf: nobody.
    """

    at: Floats
    away: Floats

    def on(self, at: Floats) -> Floats:
        """The same at other moments; nan where nothing is known."""
        index = np.searchsorted(self.at, at, "right") - 1
        known = (index >= 0) & (at - self.at[np.maximum(index, 0)] <= _LASTS_S)
        found: Floats = np.where(known, self.away[np.maximum(index, 0)], np.nan)
        return found


def nearest_of(rows: Sequence[tuple[float, float]]) -> Nearest:
    """Of moments and distances."""
    at, away = np.array(sorted(rows), np.float64).reshape(-1, 2).T.copy()
    return Nearest(at, away)


def missed(away: Floats, drives: Flags, slow: Flags) -> Flags:
    """Where somebody is near a robot that drives and is not slowed."""
    return drives & ~slow & (away <= NEAR_M)


def false_alarms(away: Floats, drives: Flags, slow: Flags) -> Flags:
    """Where a robot that drives is slowed for a person, and nobody is near."""
    return drives & slow & (away > AWAY_M)
