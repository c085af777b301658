"""The rule over a range, as arrays: who would have been slowed, when, by whom.

The same facts as ``iveg.domain.rule``, five times a second, as often as that looks
ahead; ``tests/unit/domain/test_what_if`` compares both.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from types import MappingProxyType

import numpy as np

from iveg.domain.limits import LIMITS
from iveg.domain.what_if.crossings import Crossings
from iveg.domain.what_if.inputs import Flags, Floats, Indices, Inputs, Poses, Sightings
from iveg.domain.what_if.parameters import Parameters, reach_m, widest
from iveg.domain.what_if.steps import STEP_S, Grid, Rings
from iveg.domain.what_if.truth import Nearest

_Thresholds = tuple[float, float]
"""Of people and of strange robots."""


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
        truth: Of robots of which it is known.

    Attributes:
        away: How near somebody really was at each step (m); nan: not known.
    """

    def __init__(
        self,
        inputs: Inputs,
        since: float,
        until: float,
        truth: Mapping[str, Nearest] = MappingProxyType({}),
    ) -> None:
        self.inputs, self.since = inputs, since
        self.steps = max(0, round((until - since) / STEP_S))
        at: Floats = since + STEP_S * np.arange(self.steps, dtype=np.float64)
        self.grids = {name: _grid(one, at) for name, one in inputs.poses.items()}
        self.away = {name: one.on(at) for name, one in truth.items()}
        self._people = set(
            inputs.sightings.subject[inputs.sightings.is_person].tolist()
        )
        self._near: dict[str, Flags] = {}

    def judge(self, tried: Parameters) -> Sequence[Stretch]:
        """Every slow-down, by robot and cause."""
        return self.judge_all([tried])[tried]

    def judge_all(
        self, tried: Collection[Parameters]
    ) -> Mapping[Parameters, Sequence[Stretch]]:
        """Of each; what some of them have in common is looked at once."""
        found: dict[Parameters, list[Stretch]] = {one: [] for one in tried}
        for radius_m in {one.radius_m for one in tried}:
            alike = [one for one in found if one.radius_m == radius_m]
            rings, counted = self._seen(alike)
            for robot_id in self.grids:
                for one, stretch in self._seen_by(robot_id, rings, counted, alike):
                    found[one].append(stretch)
                for one, stretch in self._peers_of(robot_id, alike):
                    found[one].append(stretch)
        return found

    def _seen_by(
        self,
        robot_id: str,
        rings: Rings,
        counted: Mapping[_Thresholds, Flags],
        tried: Collection[Parameters],
    ) -> Iterator[tuple[Parameters, Stretch]]:
        """Slow-downs for people and strange robots."""
        crossings = self._crossings(robot_id, rings, tried)
        for one in tried:
            wanted = counted[one.threshold, one.robot_threshold]
            for first, end, cause in crossings.of(one, wanted):
                reason = "person" if cause in self._people else "robot"
                yield one, Stretch(robot_id, f"s{cause}", reason, first, end)

    def _peers_of(
        self, robot_id: str, tried: Collection[Parameters]
    ) -> Iterator[tuple[Parameters, Stretch]]:
        """Slow-downs for peers, which no threshold and no factor changes."""
        peers = list(self.grids)
        circles = [
            self._circle(number, self.grids[peer], self.grids[robot_id], widest(tried))
            for number, peer in enumerate(peers)
            if peer != robot_id
        ]
        if not circles:
            return
        crossings = self._crossings(robot_id, _together(circles), tried)
        known: dict[Parameters, Sequence[tuple[int, int, int]]] = {}
        for one in tried:
            bare = replace(one, threshold=0, robot_threshold=0, factor=0)
            if bare not in known:
                known[bare] = crossings.of(bare)
            for first, end, peer in known[bare]:
                yield one, Stretch(robot_id, peers[peer], "robot", first, end)

    def _crossings(
        self, robot_id: str, rings: Rings, tried: Collection[Parameters]
    ) -> Crossings:
        braking = self.inputs.braking[robot_id]
        return Crossings(self.grids[robot_id], rings, tried, braking)

    def near(self, robot_id: str) -> Flags:
        """Whether somebody whom the rule of then saw within a second is within 2 m."""
        if robot_id not in self._near:
            self._near[robot_id] = self._find_near(self.grids[robot_id])
        return self._near[robot_id]

    def _find_near(self, grid: Grid) -> Flags:
        seen = self.inputs.sightings
        counted = seen.counted & seen.is_person
        end = _ends(seen, counted, counted, LIMITS.seen_s)
        rings, _ = self._rings(seen, end)
        apart = np.hypot(rings.x - grid.x[rings.step], rings.y - grid.y[rings.step])
        near = np.zeros(self.steps, np.bool_)
        near[rings.step[apart <= LIMITS.ring_default_m]] = True
        return near

    def _seen(
        self, tried: Collection[Parameters]
    ) -> tuple[Rings, Mapping[_Thresholds, Flags]]:
        """The circles that count by any of them; and which by which thresholds."""
        seen = self.inputs.sightings
        ends = {
            pair: _ends_by(seen, *pair)
            for pair in {(one.threshold, one.robot_threshold) for one in tried}
        }
        rings, of = self._rings(seen, np.max(list(ends.values()), axis=0))
        return rings, {
            pair: rings.step < self._step_from(end)[of] for pair, end in ends.items()
        }

    def _rings(self, seen: Sightings, end: Floats) -> tuple[Rings, Indices]:
        """The circles of each sighting until its end; and of which each is."""
        rows, step = _spread(self._step_from(seen.at), self._step_from(end))
        order = np.lexsort((step, seen.subject[rows]))
        of, step = rows[order], step[order]
        age = self.since + STEP_S * step - seen.at[of]
        subject, x, y = seen.subject[of], seen.x[of], seen.y[of]
        return Rings(step, subject, x, y, seen.vx[of], seen.vy[of], age), of

    def _step_from(self, at: Floats) -> Indices:
        step = np.ceil((at - self.since) / STEP_S - 1e-9)
        return np.clip(step, 0, self.steps).astype(np.intp)

    def _circle(self, number: int, peer: Grid, robot: Grid, tried: Parameters) -> Rings:
        """A peer's own circle at each step at which a robot may give way to it."""
        rests = peer.stands & (peer.age <= LIMITS.silence_s)
        reach = reach_m(tried, peer.age, robot.top + np.abs(peer.linear))
        east, north = peer.x - robot.x, peer.y - robot.y
        near = east * east + north * north <= reach * reach
        step = np.flatnonzero(near & ~rests & (peer.age <= LIMITS.ring_lasts_s))
        speed, yaw = peer.linear[step], peer.yaw[step]
        causes = np.full(len(step), number, np.intp)
        goes = speed * np.cos(yaw), speed * np.sin(yaw)
        return Rings(step, causes, peer.x[step], peer.y[step], *goes, peer.age[step])


def _ends_by(seen: Sightings, threshold: float, robot_threshold: float) -> Floats:
    """When the ring of each sighting ends by these thresholds (Unix s)."""
    least = np.where(seen.is_person, threshold, robot_threshold)
    return _ends(seen, seen.belief >= least, seen.probability >= least)


def _ends(
    seen: Sightings, counted: Flags, sure: Flags, lasts_s: float = LIMITS.ring_lasts_s
) -> Floats:
    """When the ring of each sighting ends (Unix s); -inf: it does not count.

    What counts by looks alone takes no ring from what counts by its box.
    """
    end = np.where(counted, seen.at + lasts_s, -np.inf)
    _end_with_next(seen, end, np.flatnonzero(counted))
    boxes = np.flatnonzero(counted & sure)
    end[boxes] = seen.at[boxes] + lasts_s
    _end_with_next(seen, end, boxes)
    return end


def _end_with_next(seen: Sightings, end: Floats, some: Indices) -> None:
    """Let the ring of each of these end where the next of its chain begins."""
    this, following = some[:-1], some[1:]
    same = seen.chain[this] == seen.chain[following]
    end[this[same]] = np.minimum(end[this], seen.at[following])[same]


def _together(rings: Sequence[Rings]) -> Rings:
    """All of them, whose causes rise."""
    return Rings(
        *(
            np.concatenate([getattr(one, field.name) for one in rings])
            for field in fields(Rings)
        )
    )


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
