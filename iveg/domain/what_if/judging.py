"""The rule over a range, as arrays: who would have been slowed, when, by whom.

The same facts as ``iveg.domain.rule``, five times a second, as often as that looks
ahead; ``tests/unit/domain/test_what_if`` compares both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
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
from iveg.domain.what_if.inputs import Flags, Floats, Indices, Inputs, Poses, Sightings

STEP_S: Final = EVERY_S
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
class Stretch:
    """One robot slowed for one cause: steps ``first`` to ``end``, exclusive."""

    robot_id: str
    cause: str
    reason: str
    first: int
    end: int


@dataclass(frozen=True, slots=True)
class _Rings:
    """Circles, each at one step; each of shape (n,)."""

    step: Indices
    cause: Indices
    x: Floats
    y: Floats
    vx: Floats
    vy: Floats
    age: Floats

    def where(self, wanted: Flags | Indices) -> "_Rings":
        """Some of them."""
        return _Rings(
            self.step[wanted],
            self.cause[wanted],
            self.x[wanted],
            self.y[wanted],
            self.vx[wanted],
            self.vy[wanted],
            self.age[wanted],
        )


class Range:
    """Inputs of a range, on a grid of steps.

    Args:
        inputs: Those of some seconds before, too: who was seen then has a ring yet.
        since: First step (Unix s).
        until: End (Unix s).
    """

    def __init__(self, inputs: Inputs, since: float, until: float) -> None:
        self.inputs, self.since = inputs, since
        self.steps = max(0, round((until - since) / STEP_S))
        at: Floats = since + STEP_S * np.arange(self.steps, dtype=np.float64)
        self.grids = {name: _grid(one, at) for name, one in inputs.poses.items()}
        seen = inputs.sightings
        self._people = set(seen.subject[seen.is_person].tolist())
        self._for_peers: dict[Parameters, Sequence[Stretch]] = {}

    def judge(self, tried: Parameters) -> Iterator[Stretch]:
        """Every slow-down, by robot and cause."""
        seen = self.inputs.sightings
        least = np.where(seen.is_person, tried.threshold, tried.robot_threshold)
        counted = np.flatnonzero(seen.belief >= least)
        sure = seen.probability[counted] >= least[counted]
        rings = self._rings(seen, counted, sure)
        for robot_id, grid in self.grids.items():
            for first, end, cause in self._crossings(robot_id, grid, tried).of(rings):
                reason = "person" if cause in self._people else "robot"
                yield Stretch(robot_id, f"s{cause}", reason, first, end)
        yield from self._peers_of(
            replace(tried, threshold=0, robot_threshold=0, factor=0)
        )

    def _peers_of(self, tried: Parameters) -> Sequence[Stretch]:
        """Slow-downs for peers, which no threshold and no factor changes."""
        if tried not in self._for_peers:
            circles = {
                peer: self._circle(peer, number)
                for number, peer in enumerate(self.grids)
            }
            self._for_peers[tried] = [
                Stretch(robot_id, peer, "robot", first, end)
                for robot_id, grid in self.grids.items()
                for peer, circle in circles.items()
                if peer != robot_id
                for first, end, _ in self._crossings(robot_id, grid, tried).of(circle)
            ]
        return self._for_peers[tried]

    def _crossings(self, robot_id: str, grid: Grid, tried: Parameters) -> "_Crossings":
        return _Crossings(grid, tried, self.inputs.braking[robot_id])

    def near(self, robot_id: str) -> Flags:
        """Whether somebody whom the rule of then saw within a second is within 2 m."""
        seen, grid = self.inputs.sightings, self.grids[robot_id]
        counted = np.flatnonzero(seen.counted & seen.is_person)
        rings = self._rings(seen, counted, np.ones(len(counted), np.bool_))
        rings = rings.where(rings.age <= LIMITS.seen_s)
        apart = np.hypot(rings.x - grid.x[rings.step], rings.y - grid.y[rings.step])
        near = np.zeros(self.steps, np.bool_)
        near[rings.step[apart <= LIMITS.ring_default_m]] = True
        return near

    def _rings(self, seen: Sightings, counted: Indices, sure: Flags) -> _Rings:
        """The circles of each chain at each step, for ten seconds.

        What counts by looks alone takes no ring from what counts by its box.
        """
        at, chain = seen.at[counted], seen.chain[counted]
        end = at + LIMITS.ring_lasts_s
        _end_with_next(at, chain, end, np.arange(len(at)))
        boxes = np.flatnonzero(sure)
        end[boxes] = at[boxes] + LIMITS.ring_lasts_s
        _end_with_next(at, chain, end, boxes)
        first, last = (self._step_from(one) for one in (at, end))
        rows, step = _spread(first, last)
        of = counted[rows]
        age = self.since + STEP_S * step - seen.at[of]
        subject, x, y = seen.subject[of], seen.x[of], seen.y[of]
        return _Rings(step, subject, x, y, seen.vx[of], seen.vy[of], age)

    def _step_from(self, at: Floats) -> Indices:
        step = np.ceil((at - self.since) / STEP_S - 1e-9)
        return np.clip(step, 0, self.steps).astype(np.intp)

    def _circle(self, peer: str, number: int) -> _Rings:
        """A peer's own circle at each step at which one gives way to it."""
        grid = self.grids[peer]
        rests = grid.stands & (grid.age <= LIMITS.silence_s)
        step = np.flatnonzero(~rests & (grid.age <= LIMITS.ring_lasts_s))
        goes = grid.linear * np.cos(grid.yaw), grid.linear * np.sin(grid.yaw)
        columns = (grid.x, grid.y, *goes, grid.age)
        causes = np.full(len(step), number, np.intp)
        return _Rings(step, causes, *(one[step] for one in columns))


def _end_with_next(at: Floats, chain: Indices, end: Floats, some: Indices) -> None:
    """Let the ring of each of these end where the next of its chain begins."""
    this, following = some[:-1], some[1:]
    same = chain[this] == chain[following]
    end[this[same]] = np.minimum(end[this], at[following])[same]


def _grid(poses: Poses, at: Floats) -> Grid:
    index = np.searchsorted(poses.at, at, "right") - 1
    known = np.maximum(index, 0)
    age = np.where(index >= 0, at - poses.at[known], np.inf)
    columns = poses.x, poses.y, poses.yaw, poses.linear, poses.angular
    x, y, yaw, linear, angular = (one[known] for one in columns)
    fastest = np.abs(linear)
    for back in range(1, round(1.0 / STEP_S) + 1):
        fastest[back:] = np.maximum(fastest[back:], np.abs(linear[:-back]))
    return Grid(x, y, yaw, linear, angular, age, fastest)


def _spread(first: Indices, last: Indices) -> tuple[Indices, Indices]:
    """Each row once for each of its steps: numbers of rows, and steps."""
    lengths = np.maximum(0, last - first)
    rows = np.repeat(np.arange(len(first)), lengths)
    begins = np.cumsum(lengths) - lengths
    return rows, np.arange(len(rows)) - begins[rows] + first[rows]


class _Crossings:
    """Slow-downs of one robot."""

    def __init__(self, grid: Grid, tried: Parameters, braking: float) -> None:
        self._grid, self._tried, self._braking = grid, tried, braking
        # A robot of which nothing was heard for long is no robot that drives.
        self._is_there = grid.age <= LIMITS.ring_lasts_s

    def of(self, rings: _Rings) -> Iterator[tuple[int, int, int]]:
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
        self, near: _Rings, groups: list[tuple[int, int, int]], holds: Flags
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
        rings: _Rings,
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
        for begin in range(0, len(asked), _AT_ONCE):
            some = asked[begin : begin + _AT_ONCE]
            in_s[some] = self._in_s(rings.where(some), radius[some], factors[some])
        in_s[in_s > within] = np.inf
        return depth, in_s

    def _in_s(self, rings: _Rings, radius: Floats, faster: Floats) -> Floats:
        """When the arc of each robot's twist meets each ring that goes on (s)."""
        grid, step = self._grid, rings.step
        x, y = _arcs(
            grid.x[step],
            grid.y[step],
            grid.yaw[step],
            grid.linear[step] * faster,
            grid.angular[step] * faster,
        )
        on = AHEAD_S + rings.age[:, None]
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
            met, AHEAD_S[at - 1] + (AHEAD_S[1] - AHEAD_S[0]) * before / gap, np.inf
        )
        return found


def _soon(braking: float, speed: Floats) -> Floats:
    """``slows_within_s`` of many speeds (s)."""
    still = slows_within_s(braking, 0.0)
    return still + np.abs(speed) * (slows_within_s(braking, 1.0) - still)


def _arcs(
    x: Floats, y: Floats, yaw: Floats, linear: Floats, angular: Floats
) -> tuple[Floats, Floats]:
    """Arcs of twists, shape (robots, moments) (m): ``paths.path_ahead`` of many."""
    way = linear[:, None] * AHEAD_S
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    east, north = way * cos, way * sin
    turning = np.flatnonzero(np.abs(angular) >= 1e-3)
    turned = yaw[turning, None] + angular[turning, None] * AHEAD_S
    radius = (linear[turning] / angular[turning])[:, None]
    east[turning] = radius * (np.sin(turned) - sin[turning])
    north[turning] = radius * (cos[turning] - np.cos(turned))
    return x[:, None] + east, y[:, None] + north


def _groups(
    near: _Rings, enters: Flags, holds: Flags, release_after_s: float
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
