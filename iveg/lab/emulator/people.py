"""Simulated people who walk the aisles, work at the rows, and give way to robots.

A person walks from stop to stop, stays a while at each, and starts over.  Near a robot
the person moves sideways along it, so that a robot and a person never block each other
for ever.  Left out: talking, surprise, running.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iveg.domain.geometry import PERSON_RADIUS_M
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery

WALKING_SPEED = 1.4
"""(m/s), as in the seed paper; ISO 13855 assumes 1.6."""

_KEEPS_OFF_M = 0.45
"""Distance between a person and a robot below which the person steps aside (m)."""
_STEP_ASIDE_SPEED = 0.8
_ARRIVED_M = 0.05


@dataclass(frozen=True, slots=True)
class WalkStop:
    """A place to walk to, and the time spent there (s)."""

    x: float
    y: float
    least_s: float = 0.0
    most_s: float = 0.0


class SimulatedPerson:
    """One person with a round of stops.

    Args:
        round_: Stops in order; the first follows the last.
        rng: Random source of the time at each stop.
    """

    def __init__(self, round_: Sequence[WalkStop], rng: np.random.Generator) -> None:
        self._round = tuple(round_)
        self._rng = rng
        self._next = 0
        self._busy_s = self._drawn()
        self._held = False
        self.x, self.y = round_[0].x, round_[0].y

    @property
    def disc(self) -> Disc:
        """Footprint of the person."""
        return Disc(self.x, self.y, PERSON_RADIUS_M)

    def place(self, x: float, y: float, *, hold: bool) -> None:
        """Move the person to a position; with ``hold`` the person stays there."""
        self.x, self.y, self._held = x, y, hold

    def step(self, dt: float, robots: Sequence[Body], scenery: Scenery) -> None:
        """Walk, work or step aside for ``dt`` (s)."""
        if self._held:
            return
        move_x, move_y = self._walk(dt)
        for robot in robots:
            move_x, move_y = self._give_way(move_x, move_y, dt, robot)
        self._move(move_x, move_y, scenery)

    def _drawn(self) -> float:
        stop = self._round[self._next]
        return float(self._rng.uniform(stop.least_s, stop.most_s))

    def _walk(self, dt: float) -> tuple[float, float]:
        if self._busy_s > 0.0:
            self._busy_s -= dt
            if self._busy_s <= 0.0:
                self._next = (self._next + 1) % len(self._round)
            return 0.0, 0.0
        goal = self._round[self._next]
        dx, dy = goal.x - self.x, goal.y - self.y
        away = math.hypot(dx, dy)
        if away < _ARRIVED_M:
            self._busy_s = max(self._drawn(), dt)
            return 0.0, 0.0
        way = min(WALKING_SPEED * dt, away)
        return dx / away * way, dy / away * way

    def _give_way(
        self, move_x: float, move_y: float, dt: float, robot: Body
    ) -> tuple[float, float]:
        gap, out_x, out_y = robot.gap_to(self.x, self.y)
        near = _KEEPS_OFF_M + PERSON_RADIUS_M - gap
        if near <= 0.0:
            return move_x, move_y
        inward = move_x * out_x + move_y * out_y
        if inward < 0.0:
            move_x, move_y = self._slide(move_x, move_y, out_x, out_y)
        push = min(near, _STEP_ASIDE_SPEED * dt)
        return move_x + out_x * push, move_y + out_y * push

    def _slide(
        self, move_x: float, move_y: float, out_x: float, out_y: float
    ) -> tuple[float, float]:
        """The same step sideways along the robot; head-on, to the robot's left."""
        along = move_y * out_x - move_x * out_y
        way = math.hypot(move_x, move_y)
        turn = math.copysign(way, along) if abs(along) > 0.05 * way else way
        return -out_y * turn, out_x * turn

    def _move(self, dx: float, dy: float, scenery: Scenery) -> None:
        """Move by this step, or along an obstacle; a person inside one may leave it."""
        inside = not scenery.free(self.x, self.y, PERSON_RADIUS_M)
        for step_x, step_y in ((dx, dy), (dx, 0.0), (0.0, dy)):
            x, y = self.x + step_x, self.y + step_y
            if inside or scenery.free(x, y, PERSON_RADIUS_M):
                self.x, self.y = x, y
                return
