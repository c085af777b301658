"""Robots and rings at each step of time, as arrays."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from iveg.domain.limits import LIMITS
from iveg.domain.rule.paths import EVERY_S
from iveg.domain.what_if.inputs import Flags, Floats, Indices

STEP_S: Final = EVERY_S
"""Of the grid: as often as the rule looks ahead."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Where a robot is at each step; each of shape (steps,).

    Attributes:
        age: Of its newest pose (s); inf before the first.
        fastest: Of the last second (m/s).
    """

    x: Floats
    y: Floats
    yaw: Floats
    linear: Floats
    angular: Floats
    age: Floats
    fastest: Floats

    @property
    def top(self) -> float:
        """Its greatest speed (m/s)."""
        return float(self.fastest.max(initial=0.0))

    @property
    def stands(self) -> Flags:
        """Whether its newest pose shows no motion."""
        still: Flags = (np.abs(self.linear) < LIMITS.standing_speed) & (
            np.abs(self.angular) < LIMITS.standing_speed
        )
        return still


@dataclass(frozen=True, slots=True)
class Rings:
    """Circles, each at one step; each of shape (n,), by cause and then by step."""

    step: Indices
    cause: Indices
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    age: Floats

    def where(self, wanted: Flags | Indices) -> "Rings":
        """Some of them."""
        return Rings(
            self.step[wanted],
            self.cause[wanted],
            self.x[wanted],
            self.y[wanted],
            self.vx[wanted],
            self.vy[wanted],
            self.age[wanted],
        )
