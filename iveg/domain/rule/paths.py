"""Paths of the next three seconds, and where they meet zones that move.

Of numbers alone, so that the server and the software on a robot calculate alike
(docs/safety.md, "Foresight").
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.feedback import HALF_SPEED
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.parameters import FORESIGHT_MOST_S

_Floats = NDArray[np.float64]
HORIZON_S = FORESIGHT_MOST_S
_STEP_S = 0.1
AHEAD_S: _Floats = np.arange(0.0, HORIZON_S + _STEP_S / 2, _STEP_S)
"""The moments of a path (s)."""
EVERY_S = 0.2
"""Encounters are looked for five times a second."""
MOVES_M_S = 0.05
"""Whoever is slower has no path (m/s)."""
_REACTION_S = 0.4
"""From here to the robot's brakes (s)."""
_COMFORT = 0.5
"""Share of the possible braking: nobody has to jump, and no load slides."""
PLAN_LASTS_S = 2.5
"""An older plan is not what a robot drives."""
_PLAN_WITHIN_M = 0.5
"""A plan that is farther from the robot is none, either."""
_PLAN_POINTS = 200

Plan = Sequence[tuple[float, float]]
"""Points in ``map`` (m), in the order in which a robot will pass them."""
Path = tuple[_Floats, _Floats]
"""x and y, shape (steps,) (m)."""


def slows_within_s(braking: float, speed: float) -> float:
    """Time that a robot takes to halve this speed (m/s) with comfort (s).

    Args:
        braking: What its brakes can do (m/s²).
        speed: Present speed (m/s).
    """
    return _REACTION_S + abs(speed) * (1 - HALF_SPEED) / (_COMFORT * braking)


def sped_up(twist: Twist2D, to: float) -> Twist2D:
    """The arc of a twist, driven at least so fast (m/s)."""
    faster = max(1.0, to / max(abs(twist.linear_x), MOVES_M_S))
    return Twist2D(twist.linear_x * faster, twist.angular_z * faster)


@dataclass(frozen=True, slots=True)
class Meeting:
    """A path reaches a zone.

    Attributes:
        zone: Number of the zone.
        in_s: How soon (s).
        x: Where the robot will be (m); ``y`` likewise.
        centre_x: Where the zone's centre will be (m); ``centre_y`` likewise.
    """

    zone: int
    in_s: float
    x: float
    y: float
    centre_x: float
    centre_y: float


class MovingZones:
    """Zones that go on at their velocity for the next three seconds.

    Args:
        rows: Each with x, y (m), velocity in x and y (m/s), age of all this (s) and
            radius (m).
    """

    def __init__(self, rows: Sequence[tuple[float, ...]]) -> None:
        x, y, vx, vy, age, self._radius = np.array(rows, np.float64).reshape(-1, 6).T
        goes_on = AHEAD_S[:, None] + age
        self._x, self._y = x + vx * goes_on, y + vy * goes_on

    def met_by(self, path: Path) -> tuple[list[int], Iterator[Meeting]]:
        """The zones that a path begins in, and its first meeting with each other."""
        x, y = path
        apart = np.hypot(self._x - x[:, None], self._y - y[:, None]) - self._radius
        inside = apart <= 0.0
        begins_in = np.flatnonzero(inside[0]).tolist()
        met = np.flatnonzero(inside.any(0) & ~inside[0]).tolist()
        return begins_in, (
            self._meeting(path, one, apart[:, one], int(inside[:, one].argmax()))
            for one in met
        )

    def _meeting(self, path: Path, zone: int, apart: _Floats, step: int) -> Meeting:
        """Where a distance that is at most 0 from a step on becomes so."""
        before, after = float(apart[step - 1]), float(apart[step])
        share = before / (before - after)
        x, y, centre_x, centre_y = (
            float(of[step - 1] + share * (of[step] - of[step - 1]))
            for of in (*path, self._x[:, zone], self._y[:, zone])
        )
        in_s = float(AHEAD_S[step - 1]) + _STEP_S * share
        return Meeting(zone, in_s, x, y, centre_x, centre_y)


def path_ahead(pose: Pose2D, twist: Twist2D, plan: Plan | None) -> Path:
    """Where a robot will be: along its own plan, else along the arc of its twist.

    Args:
        pose: In ``map``.
        twist: Present speed, which it keeps.
        plan: None: it told none lately.
    """
    if plan is not None and twist.linear_x >= 0.0:
        planned = _along(plan, pose, twist.linear_x)
        if planned is not None:
            return planned
    turned = pose.yaw + twist.angular_z * AHEAD_S
    if abs(twist.angular_z) < 1e-3:
        way = twist.linear_x * AHEAD_S
        return pose.x + way * math.cos(pose.yaw), pose.y + way * math.sin(pose.yaw)
    radius = twist.linear_x / twist.angular_z
    x: _Floats = pose.x + radius * (np.sin(turned) - math.sin(pose.yaw))
    y: _Floats = pose.y - radius * (np.cos(turned) - math.cos(pose.yaw))
    return x, y


def _along(plan: Plan, pose: Pose2D, speed: float) -> Path | None:
    """Along a plan at this speed (m/s); None where the robot is not driving it."""
    points = np.array(plan[:_PLAN_POINTS], np.float64).reshape(-1, 2)
    if len(points) < 2:
        return None
    starts, legs = points[:-1], np.diff(points, axis=0)
    lengths = np.hypot(*legs.T)
    to = np.array((pose.x, pose.y)) - starts
    share = np.einsum("ij,ij->i", to, legs) / np.maximum(lengths, 1e-9) ** 2
    feet = starts + np.clip(share, 0.0, 1.0)[:, None] * legs
    off = np.hypot(feet[:, 0] - pose.x, feet[:, 1] - pose.y)
    nearest = int(off.argmin())
    if off[nearest] > _PLAN_WITHIN_M:
        return None
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    here = along[nearest] + min(max(float(share[nearest]), 0.0), 1.0) * lengths[nearest]
    ways = here + speed * AHEAD_S
    x: _Floats = np.interp(ways, along, points[:, 0])
    y: _Floats = np.interp(ways, along, points[:, 1])
    return x, y
