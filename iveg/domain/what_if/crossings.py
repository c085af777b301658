"""Where a robot crosses into circles, as arrays: the rule of many moments at once."""

from collections.abc import Collection
from typing import Final

import numpy as np

from iveg.domain.limits import LIMITS, ring_radius
from iveg.domain.rule.paths import AHEAD_S, HOLDS_S, MOVES_M_S, slows_within_s
from iveg.domain.what_if.inputs import Flags, Floats, Indices
from iveg.domain.what_if.parameters import Parameters, reach_m, widest
from iveg.domain.what_if.steps import STEP_S, Grid, Rings

_PATH_STEP_S: Final = float(AHEAD_S[1] - AHEAD_S[0])
_AT_ONCE: Final = 4_000
"""Paths that are compared at once: what a core keeps near."""
_COARSE: Final = 5
"""Of so many moments of a path one is looked at first."""


class Crossings:
    """Slow-downs of one robot, for parameters that have one radius in common.

    Where it meets which ring is found once for all of them.

    Args:
        grid: Of the robot.
        rings: Of others.
        tried: All that will be asked for.
        braking: What the robot's brakes can do (m/s²).
    """

    def __init__(
        self, grid: Grid, rings: Rings, tried: Collection[Parameters], braking: float
    ) -> None:
        self._grid = grid
        self._tried = widest(tried)
        self._rows = self._reached(rings)
        self._near = rings.where(self._rows)
        self._speed = grid.linear[self._near.step]
        self._soon = _soon(braking, self._speed)
        within_s = np.maximum(HOLDS_S, self._soon)
        self._depth, self._met_in_s = self._meet(
            self._near, self._speed, np.minimum(within_s, self._tried.foresight_s)
        )

    def _reached(self, rings: Rings) -> Indices:
        """Rows of rings that may matter to the robot."""
        grid = self._grid
        speed = grid.top + np.hypot(rings.vx, rings.vy)
        reach = reach_m(self._tried, rings.age, speed)
        east, north = rings.x - grid.x[rings.step], rings.y - grid.y[rings.step]
        near = east * east + north * north <= reach * reach
        # A robot of which nothing was heard for long is no robot that drives.
        return np.flatnonzero(near & (grid.age[rings.step] <= LIMITS.ring_lasts_s))

    def _radius(self, age: Floats) -> Floats:
        return ring_radius(self._tried.radius_m, age, np.minimum, np.maximum)

    def of(
        self, tried: Parameters, wanted: Flags | None = None
    ) -> list[tuple[int, int, int]]:
        """First step, end and cause of each; ``wanted``: of these rings alone."""
        rows = np.arange(len(self._rows))
        if wanted is not None:
            rows = np.flatnonzero(wanted[self._rows])
        near = self._near.where(rows)
        if not len(near.step):
            return []
        depth, soon, in_s = self._depth[rows], self._soon[rows], self._met_in_s[rows]
        within = np.minimum(np.maximum(HOLDS_S, soon), tried.foresight_s)
        in_s = np.where((in_s <= within + 1e-6) & (within > 0.0), in_s, np.inf)
        enters = (depth <= 0.0) | (in_s <= soon)
        holds = (depth <= tried.release_beyond_m) | np.isfinite(in_s)
        groups = _groups(near, enters, holds, tried.release_after_s)
        again = self._again(near, groups, holds, tried)
        if again.any():
            groups = _groups(near, enters, holds | again, tried.release_after_s)
        return groups

    def _again(
        self,
        near: Rings,
        groups: list[tuple[int, int, int]],
        holds: Flags,
        tried: Parameters,
    ) -> Flags:
        """Whether who is slow would meet it again at the speed of before."""
        again = np.zeros(len(near.step), np.bool_)
        if not groups or not tried.foresight_s:
            return again
        # Causes in order, and steps in order for each: one key that rises.
        span = int(near.step.max()) + 2
        firsts, _, causes = np.array(groups, np.intp).T
        begun = causes * span + firsts
        of = np.searchsorted(begun, near.cause * span + near.step, "right") - 1
        slow = (of >= 0) & (causes[np.maximum(of, 0)] == near.cause) & ~holds
        rows = np.flatnonzero(slow)
        before = self._grid.fastest[firsts[of[rows]]]
        speed = self._grid.linear[near.step[rows]]
        faster = np.maximum(1.0, before / np.maximum(np.abs(speed), MOVES_M_S))
        within = np.full(len(rows), tried.foresight_s)
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

        inf: not within that time, or it is there already.
        """
        grid, radius = self._grid, self._radius(rings.age)
        x, y = grid.x[rings.step], grid.y[rings.step]
        depth: Floats = np.hypot(rings.x - x, rings.y - y) - radius
        in_s = np.full(len(rings.step), np.inf)
        goes = np.abs(speed) * faster + np.hypot(rings.vx, rings.vy)
        within = within_s + 1e-6
        asked = np.flatnonzero(
            (np.abs(speed) >= MOVES_M_S)
            & (rings.age <= LIMITS.seen_s)
            & (depth > 0.0)
            & (depth <= goes * (within + rings.age))
            & (within_s > 0.0)
        )
        factors = np.broadcast_to(faster, speed.shape)
        most = within.max(initial=0.0) + _PATH_STEP_S
        ahead = AHEAD_S[: np.searchsorted(AHEAD_S, most)]
        for begin in range(0, len(asked), _AT_ONCE):
            some = asked[begin : begin + _AT_ONCE]
            in_s[some] = self._in_s(
                rings.where(some), radius[some], factors[some], goes[some], ahead
            )
        in_s[in_s > within] = np.inf
        return depth, in_s

    def _in_s(
        self, rings: Rings, radius: Floats, faster: Floats, goes: Floats, ahead: Floats
    ) -> Floats:
        """When the arc of each robot's twist meets each ring that goes on (s)."""
        found = np.full(len(radius), np.inf)
        # Nobody comes nearer between two moments than both can go meanwhile.
        looks = np.append(ahead[:-1:_COARSE], ahead[-1])
        apart = self._apart(rings, radius, faster, looks)
        may = apart.min(1, initial=np.inf) <= goes * (_COARSE * _PATH_STEP_S / 2 + 1e-6)
        rows = np.flatnonzero(may)
        apart = self._apart(rings.where(rows), radius[rows], faster[rows], ahead)
        inside = apart <= 0.0
        met = np.flatnonzero(inside.any(1) & ~inside[:, 0])
        at = inside[met].argmax(1)
        before, after = apart[met, at - 1], apart[met, at]
        found[rows[met]] = ahead[at - 1] + _PATH_STEP_S * before / (before - after)
        return found

    def _apart(
        self, rings: Rings, radius: Floats, faster: Floats, ahead: Floats
    ) -> Floats:
        """How far outside each ring at each moment of its path (m)."""
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
        east = rings.x[:, None] + rings.vx[:, None] * on - x
        north = rings.y[:, None] + rings.vy[:, None] * on - y
        apart: Floats = np.sqrt(east * east + north * north) - radius[:, None]
        return apart


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
