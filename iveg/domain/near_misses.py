"""Near misses: seconds near somebody that hang together, the worst first."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import floor

from iveg.domain.cost import SpeedChanges
from iveg.domain.greenhouse import Greenhouse

CELL_M = 1.0
"""Side of a cell of the heat map (m)."""
NEAR_M = 1.5
"""From the middle of a driving robot to that of a person: nearer is a near miss (m)."""
_APART_S = 10.0
"""Near misses of one robot nearer in time than this are one."""


@dataclass(frozen=True, slots=True)
class NearSecond:
    """A second in which a robot drove within ``NEAR_M`` of somebody who is seen.

    Attributes:
        at: Its beginning (Unix s).
        speed: The greatest (m/s).
        distance_m: The least between the middles of both (m).
    """

    robot_id: str
    at: float
    x: float
    y: float
    speed: float
    distance_m: float


@dataclass(frozen=True, slots=True)
class NearMiss:
    """Seconds near somebody that hang together.

    Attributes:
        worst: The second of the least distance.
        seconds: How many of them there were.
        decision_id: What the robot was told then, where it was told.
    """

    worst: NearSecond
    seconds: int
    lane: str | None
    decision_id: str | None


def heat(near: Iterable[NearSecond]) -> Counter[tuple[int, int]]:
    """Cell of the plan, counted from the origin of ``map`` → seconds."""
    return Counter((floor(one.x / CELL_M), floor(one.y / CELL_M)) for one in near)


def near_misses(
    near: Sequence[NearSecond], changes: SpeedChanges, greenhouse: Greenhouse
) -> list[NearMiss]:
    """Each with its worst second, the worst first."""
    found = [
        _miss(together, changes, greenhouse)
        for together in _together(sorted(near, key=lambda it: (it.robot_id, it.at)))
    ]
    return sorted(found, key=lambda it: (it.worst.distance_m, it.worst.at))


def _together(near: Iterable[NearSecond]) -> Iterator[list[NearSecond]]:
    """Seconds of one robot that hang together, of seconds in order."""
    found: list[NearSecond] = []
    for one in near:
        if found and not _hangs(found[-1], one):
            yield found
            found = []
        found.append(one)
    if found:
        yield found


def _hangs(before: NearSecond, one: NearSecond) -> bool:
    return before.robot_id == one.robot_id and one.at - before.at <= _APART_S


def _miss(
    together: Sequence[NearSecond], changes: SpeedChanges, greenhouse: Greenhouse
) -> NearMiss:
    worst = min(together, key=lambda one: one.distance_m)
    # A decision follows the first near second as often as it comes before it.
    change = changes.why_slow(worst.robot_id, together[-1].at + 1.0)
    is_of_it = change is not None and change.at >= together[0].at - _APART_S
    return NearMiss(
        worst,
        len(together),
        greenhouse.lane_at(worst.x, worst.y),
        change.decision_id if change is not None and is_of_it else None,
    )
