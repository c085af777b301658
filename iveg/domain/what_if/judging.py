"""The rule over a range, as arrays: who would have been slowed, when, by whom.

The same facts as ``iveg.domain.rule``, five times a second, as often as that looks
ahead; ``tests/unit/domain/test_what_if`` compares both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from iveg.domain.limits import LIMITS
from iveg.domain.what_if.crossings import STEP_S, Crossings, Grid, Parameters, Rings
from iveg.domain.what_if.inputs import Flags, Floats, Indices, Inputs, Poses, Sightings


@dataclass(frozen=True, slots=True)
class Stretch:
    """One robot slowed for one cause: steps ``first`` to ``end``, exclusive."""

    robot_id: str
    cause: str
    reason: str
    first: int
    end: int


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
        self._near: dict[str, Flags] = {}
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

    def _crossings(self, robot_id: str, grid: Grid, tried: Parameters) -> Crossings:
        return Crossings(grid, tried, self.inputs.braking[robot_id])

    def near(self, robot_id: str) -> Flags:
        """Whether somebody whom the rule of then saw within a second is within 2 m."""
        if robot_id not in self._near:
            self._near[robot_id] = self._find_near(self.grids[robot_id])
        return self._near[robot_id]

    def _find_near(self, grid: Grid) -> Flags:
        seen = self.inputs.sightings
        counted = np.flatnonzero(seen.counted & seen.is_person)
        rings = self._rings(seen, counted, np.ones(len(counted), np.bool_))
        rings = rings.where(rings.age <= LIMITS.seen_s)
        apart = np.hypot(rings.x - grid.x[rings.step], rings.y - grid.y[rings.step])
        near = np.zeros(self.steps, np.bool_)
        near[rings.step[apart <= LIMITS.ring_default_m]] = True
        return near

    def _rings(self, seen: Sightings, counted: Indices, sure: Flags) -> Rings:
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
        return Rings(step, subject, x, y, seen.vx[of], seen.vy[of], age)

    def _step_from(self, at: Floats) -> Indices:
        step = np.ceil((at - self.since) / STEP_S - 1e-9)
        return np.clip(step, 0, self.steps).astype(np.intp)

    def _circle(self, peer: str, number: int) -> Rings:
        """A peer's own circle at each step at which one gives way to it."""
        grid = self.grids[peer]
        rests = grid.stands & (grid.age <= LIMITS.silence_s)
        step = np.flatnonzero(~rests & (grid.age <= LIMITS.ring_lasts_s))
        goes = grid.linear * np.cos(grid.yaw), grid.linear * np.sin(grid.yaw)
        columns = (grid.x, grid.y, *goes, grid.age)
        causes = np.full(len(step), number, np.intp)
        return Rings(step, causes, *(one[step] for one in columns))


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
