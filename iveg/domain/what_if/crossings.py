"""Where a robot crosses into circles, as arrays: the rule of many moments at once."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.rule.paths import (
    AHEAD_S,
    EVERY_S,
    HOLDS_S,
    HORIZON_S,
    MOVES_M_S,
    slows_within_s,
)
from iveg.domain.what_if.inputs import Flags, Floats, Indices

STEP_S: Final = EVERY_S
"""Of the grid: as often as the rule looks ahead."""
_PATH_STEP_S: Final = float(AHEAD_S[1] - AHEAD_S[0])
_AT_ONCE: Final = 20_000
"""Paths that are compared at once."""


@dataclass(frozen=True, slots=True)
class Parameters:
    """What may be tried.

    Attributes:
        threshold: Least confidence of a person; ``robot_threshold`` of a robot.
        radius_m: Ring of a fresh sighting (m).
        release_beyond_m: So far outside a robot is let go (m), ``release_after_s`` and
            so long after (s).
        factor: Speed inside a ring, as a share.
        foresight_s: How far ahead it looks (s); 0: not at all.
    """

    threshold: float = LIMITS.detection_threshold
    robot_threshold: float = LIMITS.detection_threshold
    radius_m: float = LIMITS.ring_default_m
    release_beyond_m: float = LIMITS.release_beyond_m
    release_after_s: float = LIMITS.release_after_s
    factor: float = LIMITS.slow_factor
    foresight_s: float = HORIZON_S


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
    def stands(self) -> Flags:
        """Whether its newest pose shows no motion."""
        still: Flags = (np.abs(self.linear) < LIMITS.standing_speed) & (
            np.abs(self.angular) < LIMITS.standing_speed
        )
        return still


@dataclass(frozen=True, slots=True)
class Rings:
    """Circles, each at one step; each of shape (n,)."""

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


class Crossings:
    """Slow-downs of one robot."""

    def __init__(self, grid: Grid, tried: Parameters, braking: float) -> None:
        self._grid, self._tried, self._braking = grid, tried, braking
        # A robot of which nothing was heard for long is no robot that drives.
        self._is_there = grid.age <= LIMITS.ring_lasts_s

    def of(self, rings: Rings) -> Iterator[tuple[int, int, int]]:
        """First step, end and cause of each."""
        grid, tried = self._grid, self._tried
        away = np.hypot(rings.x - grid.x[rings.step], rings.y - grid.y[rings.step])
        top = float(grid.fastest.max(initial=0.0)) + LIMITS.walking_m_s
        reach = LIMITS.ring_most_m + top * tried.foresight_s + tried.release_beyond_m
        near = rings.where((away <= reach) & self._is_there[rings.step])
        if not len(near.step):
            return
        near = near.where(np.lexsort((near.step, near.cause)))
        speed = grid.linear[near.step]
        soon = _soon(self._braking, speed)
        depth, in_s = self._meet(near, speed, np.maximum(HOLDS_S, soon))
        enters = (depth <= 0.0) | (in_s <= soon)
        holds = (depth <= tried.release_beyond_m) | np.isfinite(in_s)
        groups = _groups(near, enters, holds, tried.release_after_s)
        again = self._again(near, groups, holds)
        if again.any():
            groups = _groups(near, enters, holds | again, tried.release_after_s)
        yield from groups

    def _again(
        self, near: Rings, groups: list[tuple[int, int, int]], holds: Flags
    ) -> Flags:
        """Whether who is slow would meet it again at the speed of before."""
        again = np.zeros(len(near.step), np.bool_)
        if not groups or not self._tried.foresight_s:
            return again
        # Causes in order, and steps in order for each: one key that rises.
        span = int(near.step.max()) + 2
        begun = np.array([cause * span + first for first, _, cause in groups])
        firsts = np.array([first for first, _, _ in groups])
        causes = np.array([cause for _, _, cause in groups])
        of = np.searchsorted(begun, near.cause * span + near.step, "right") - 1
        slow = (of >= 0) & (causes[np.maximum(of, 0)] == near.cause) & ~holds
        rows = np.flatnonzero(slow)
        before = self._grid.fastest[firsts[of[rows]]]
        speed = self._grid.linear[near.step[rows]]
        faster = np.maximum(1.0, before / np.maximum(np.abs(speed), MOVES_M_S))
        within = np.full(len(rows), HORIZON_S)
        _, in_s = self._meet(near.where(rows), speed, within, faster)
        again[rows] = np.isfinite(in_s)
        return again

    def _meet(
        self,
        rings: Rings,
        speed: Floats,
        within_s: Floats,
        faster: Floats | float = 1.0,
    ) -> tuple[Floats, Floats]:
        """How far outside each ring (m), and how soon it is met (s).

        inf: not within that time, nor within the horizon, or it is there already.
        """
        grid, tried = self._grid, self._tried
        radius = ring_radius(tried.radius_m, rings.age, np.minimum, np.maximum)
        x, y = grid.x[rings.step], grid.y[rings.step]
        depth: Floats = np.hypot(rings.x - x, rings.y - y) - radius
        in_s = np.full(len(rings.step), np.inf)
        goes = np.abs(speed) * faster + np.hypot(rings.vx, rings.vy)
        within = np.minimum(within_s, tried.foresight_s) + 1e-6
        asked = np.flatnonzero(
            (np.abs(speed) >= MOVES_M_S)
            & (rings.age <= LIMITS.seen_s)
            & (depth > 0.0)
            & (depth <= goes * (within + rings.age))
            & (tried.foresight_s > 0.0)
        )
        factors = np.broadcast_to(faster, speed.shape)
        ahead = AHEAD_S[
            : np.searchsorted(AHEAD_S, within.max(initial=0.0) + _PATH_STEP_S)
        ]
        for begin in range(0, len(asked), _AT_ONCE):
            some = asked[begin : begin + _AT_ONCE]
            found = self._in_s(rings.where(some), radius[some], factors[some], ahead)
            in_s[some] = found
        in_s[in_s > within] = np.inf
        return depth, in_s

    def _in_s(
        self, rings: Rings, radius: Floats, faster: Floats, ahead: Floats
    ) -> Floats:
        """When the arc of each robot's twist meets each ring that goes on (s)."""
        grid, step = self._grid, rings.step
        x, y = _arcs(
            grid.x[step],
            grid.y[step],
            grid.yaw[step],
            grid.linear[step] * faster,
            grid.angular[step] * faster,
            ahead,
        )
        on = ahead + rings.age[:, None]
        apart = np.hypot(
            rings.x[:, None] + rings.vx[:, None] * on - x,
            rings.y[:, None] + rings.vy[:, None] * on - y,
        )
        apart -= radius[:, None]
        inside = apart <= 0.0
        met = inside.any(1) & ~inside[:, 0]
        at = np.maximum(inside.argmax(1), 1)
        rows = np.arange(len(at))
        before, after = apart[rows, at - 1], apart[rows, at]
        gap = np.where(met, before - after, 1.0)
        found: Floats = np.where(
            met, ahead[at - 1] + _PATH_STEP_S * before / gap, np.inf
        )
        return found


def _soon(braking: float, speed: Floats) -> Floats:
    """``slows_within_s`` of many speeds (s)."""
    still = slows_within_s(braking, 0.0)
    return still + np.abs(speed) * (slows_within_s(braking, 1.0) - still)


def _arcs(
    x: Floats,
    y: Floats,
    yaw: Floats,
    linear: Floats,
    angular: Floats,
    ahead: Floats,
) -> tuple[Floats, Floats]:
    """Arcs of twists, shape (robots, moments) (m): ``paths.path_ahead`` of many."""
    way = linear[:, None] * ahead
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    east, north = way * cos, way * sin
    turning = np.flatnonzero(np.abs(angular) >= 1e-3)
    turned = yaw[turning, None] + angular[turning, None] * ahead
    radius = (linear[turning] / angular[turning])[:, None]
    east[turning] = radius * (np.sin(turned) - sin[turning])
    north[turning] = radius * (cos[turning] - np.cos(turned))
    return x[:, None] + east, y[:, None] + north


def _groups(
    near: Rings, enters: Flags, holds: Flags, release_after_s: float
) -> list[tuple[int, int, int]]:
    """Runs in which a cause holds a robot from where it enters: first, end, cause.

    Held rows of one cause belong together unless the robot was let go in between.
    """
    rows = np.flatnonzero(enters | holds)
    if not len(rows):
        return []
    step, cause, enter = near.step[rows], near.cause[rows], enters[rows]
    waits = round(release_after_s / STEP_S)
    apart = (np.diff(cause) != 0) | (np.diff(step) - 1 >= max(1, waits))
    begins = np.concatenate(([0], np.flatnonzero(apart) + 1))
    ends = np.concatenate((begins[1:], [len(rows)]))
    never = np.iinfo(np.intp).max
    entered = np.minimum.reduceat(np.where(enter, step, never), begins)
    left = step[ends - 1] + 1 + waits
    return [
        (int(first), int(end), int(of))
        for first, end, of in zip(entered, left, cause[begins], strict=True)
        if first != never
    ]
