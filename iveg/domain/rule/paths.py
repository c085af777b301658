"""Paths of the next three seconds, and where they meet zones that move.

Pure arithmetic, so that the server and the software on a robot calculate alike
(docs/safety.md, "Foresight").
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

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
"""Time between two forecasts (s)."""
MOVES_M_S = 0.05
"""Least speed of a robot with a path (m/s)."""
_REACTION_S = 0.4
"""Time from a judgement here to the robot's brakes (s)."""
_COMFORT = 0.5
"""Share of the possible braking that is used, so that no load slides."""
PLAN_LASTS_S = 2.5
"""Greatest age of a plan that the robot still drives (s)."""
_PLAN_WITHIN_M = 0.5
"""Greatest distance between a robot and the plan that it drives (m)."""
_PLAN_POINTS = 200

Plan = Sequence[tuple[float, float]]
"""Points in ``map`` (m), in the order in which a robot will pass them."""
Path = tuple[_Floats, _Floats]
"""x and y, shape (steps,) (m)."""


def slows_within_s(braking: float, speed: float) -> float:
    """Time that a robot takes to halve this speed (m/s) with comfort (s).

    Args:
        braking: Deceleration of its brakes (m/s²).
        speed: Present speed (m/s).
    """
    return _REACTION_S + abs(speed) * (1 - HALF_SPEED) / (_COMFORT * braking)


def sped_up(twist: Twist2D, to: float) -> Twist2D:
    """Arc of a twist, driven at ``to`` (m/s) or faster."""
    faster = max(1.0, to / max(abs(twist.linear_x), MOVES_M_S))
    return Twist2D(twist.linear_x * faster, twist.angular_z * faster)


@dataclass(frozen=True, slots=True)
class Meeting:
    """First point of a path on the border of a zone.

    Attributes:
        zone: Number of the zone.
        in_s: Time to it (s).
        x: Place of the robot then (m); ``y`` likewise.
        centre_x: Place of the zone's centre then (m); ``centre_y`` likewise.
    """

    zone: int
    in_s: float
    x: float
    y: float
    centre_x: float
    centre_y: float


class MovingZone(NamedTuple):
    """A zone whose centre moves: place (m) and velocity (m/s) of ``age_s`` ago."""

    x: float
    y: float
    vx: float
    vy: float
    age_s: float
    radius_m: float


class MovingZones:
    """Zones that keep their velocity for the next three seconds."""

    def __init__(self, zones: Sequence[MovingZone]) -> None:
        x, y, vx, vy, age, self._radius = np.array(zones, np.float64).reshape(-1, 6).T
        # Each has moved on since the moment of its place.
        moved_s = AHEAD_S[:, None] + age
        self._x, self._y = x + vx * moved_s, y + vy * moved_s

    def met_by(self, path: Path) -> tuple[list[int], Iterator[Meeting]]:
        """The zones that a path begins in, and its first meeting with each other."""
        x, y = path
        distance = np.hypot(self._x - x[:, None], self._y - y[:, None]) - self._radius
        inside = distance <= 0.0
        begins_in = np.flatnonzero(inside[0]).tolist()
        entered = np.flatnonzero(inside.any(0) & ~inside[0]).tolist()
        return begins_in, (
            self._meeting(path, zone, distance[:, zone], int(inside[:, zone].argmax()))
            for zone in entered
        )

    def _meeting(self, path: Path, zone: int, distance: _Floats, step: int) -> Meeting:
        """Point between two steps at which the distance from the border becomes 0."""
        before, after = float(distance[step - 1]), float(distance[step])
        share = before / (before - after)
        x, y, centre_x, centre_y = (
            float(values[step - 1] + share * (values[step] - values[step - 1]))
            for values in (*path, self._x[:, zone], self._y[:, zone])
        )
        in_s = float(AHEAD_S[step - 1]) + _STEP_S * share
        return Meeting(zone, in_s, x, y, centre_x, centre_y)


def path_ahead(pose: Pose2D, twist: Twist2D, plan: Plan | None) -> Path:
    """Path of a robot: along its own plan, else along the arc of its twist.

    Args:
        pose: In ``map``.
        twist: Present speed, which it keeps.
        plan: Its own plan; None: none was received lately.
    """
    # A plan is driven forwards: a robot that reverses does not follow it.
    if plan is not None and twist.linear_x >= 0.0:
        planned = _along(plan, pose, twist.linear_x)
        if planned is not None:
            return planned
    turned = pose.yaw + twist.angular_z * AHEAD_S
    # Nearly straight: an arc would have no finite radius.
    if abs(twist.angular_z) < 1e-3:
        way = twist.linear_x * AHEAD_S
        return pose.x + way * math.cos(pose.yaw), pose.y + way * math.sin(pose.yaw)
    radius = twist.linear_x / twist.angular_z
    x: _Floats = pose.x + radius * (np.sin(turned) - math.sin(pose.yaw))
    y: _Floats = pose.y - radius * (np.cos(turned) - math.cos(pose.yaw))
    return x, y


def _along(plan: Plan, pose: Pose2D, speed: float) -> Path | None:
    """Path along a plan at this speed (m/s); None: the robot is too far from it."""
    points = np.array(plan[:_PLAN_POINTS], np.float64).reshape(-1, 2)
    if len(points) < 2:
        return None
    starts, legs = points[:-1], np.diff(points, axis=0)
    lengths = np.hypot(*legs.T)
    vectors = np.array((pose.x, pose.y)) - starts
    # Two equal points of a plan are a leg without length.
    share = np.einsum("ij,ij->i", vectors, legs) / np.maximum(lengths, 1e-9) ** 2
    feet = starts + np.clip(share, 0.0, 1.0)[:, None] * legs
    distances = np.hypot(feet[:, 0] - pose.x, feet[:, 1] - pose.y)
    nearest = int(distances.argmin())
    if distances[nearest] > _PLAN_WITHIN_M:
        return None
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    start = (
        along[nearest] + min(max(float(share[nearest]), 0.0), 1.0) * lengths[nearest]
    )
    stations = start + speed * AHEAD_S
    x: _Floats = np.interp(stations, along, points[:, 0])
    y: _Floats = np.interp(stations, along, points[:, 1])
    return x, y
