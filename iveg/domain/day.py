"""The evening sheet: one day of the fleet in a few numbers, from the history alone.

Poses are means over a second, so the distance of a pass is exact to about half a metre,
the way that a person and a robot move within that second.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import hypot

from iveg.domain.greenhouse import Greenhouse
from iveg.domain.limits import LIMITS
from iveg.domain.records import DecisionRecord

PASSES_SHOWN = 3
_APART_S = 60.0
"""Passes of one robot nearer in time than this are one."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Pose of a robot in one second, and its speed (m/s)."""

    robot_id: str
    second: int
    x: float
    y: float
    speed: float


@dataclass(frozen=True, slots=True)
class DaySighting:
    """Position of a person in one second."""

    second: int
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Passing:
    """A robot near a person.

    Attributes:
        distance_m: Between the middles of both.
        speed: The robot's (m/s).
        lane: Aisle of the person.
    """

    at: float
    robot_id: str
    distance_m: float
    speed: float
    lane: str | None


@dataclass(frozen=True, slots=True)
class EncounterCounts:
    """Number of times that a robot came to the zone of a person.

    Attributes:
        slowed: Those of which the robot itself said that it was slow.
    """

    count: int = 0
    slowed: int = 0


def encounter_counts(decisions: Iterable[DecisionRecord]) -> EncounterCounts:
    """The encounters with people among these decisions."""
    met = [one for one in decisions if one.kind == "mandate" and one.reason == "person"]
    return EncounterCounts(len(met), sum(one.applied_at is not None for one in met))


def worked_minutes(
    poses: Iterable[Pose], greenhouse: Greenhouse
) -> dict[str, dict[str, float]]:
    """Aisle → robot → minutes that it drove there."""
    seconds: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for pose in poses:
        lane = greenhouse.lane_at(pose.x, pose.y)
        if lane is not None and abs(pose.speed) >= LIMITS.standing_speed:
            seconds[lane][pose.robot_id] += 1
    return {
        lane.label: {robot: n / 60.0 for robot, n in seconds[lane.label].items()}
        for lane in greenhouse.lanes
        if lane.label in seconds
    }


def slowed_minutes(
    decisions: Iterable[DecisionRecord], greenhouse: Greenhouse, until: float
) -> dict[tuple[str, str | None], float]:
    """(cause, aisle of the cause) → minutes of a robot slowed; each counted once.

    Args:
        decisions: Of the day.
        greenhouse: Its aisles.
        until: When a slow-down that goes on is cut off (Unix s).
    """
    spans: dict[tuple[str, str | None, str], list[tuple[float, float]]] = {}
    for one in decisions:
        if one.kind != "mandate":
            continue
        known = one.x is not None and one.y is not None
        lane = greenhouse.lane_at(one.x or 0.0, one.y or 0.0) if known else None
        key = one.reason or "", lane, one.robot_id
        end = until if one.ended_at is None else min(one.ended_at, until)
        spans.setdefault(key, []).append((one.started_at, end))
    minutes: dict[tuple[str, str | None], float] = defaultdict(float)
    for (reason, lane, _), found in spans.items():
        minutes[reason, lane] += length(found) / 60.0
    return dict(minutes)


def length(spans: Iterable[tuple[float, float]]) -> float:
    """Length of the union of these spans (s)."""
    total, covered = 0.0, float("-inf")
    for start, end in sorted(spans):
        total += max(0.0, end - max(start, covered))
        covered = max(covered, end)
    return total


def closest_passes(
    poses: Sequence[Pose], seen: Iterable[DaySighting], greenhouse: Greenhouse
) -> list[Passing]:
    """The closest passes of moving robots near people, nearest first."""
    by_second: dict[int, list[Pose]] = defaultdict(list)
    for pose in poses:
        if abs(pose.speed) >= LIMITS.standing_speed:
            by_second[pose.second].append(pose)
    near = [
        _passing(pose, one, greenhouse)
        for one in seen
        for pose in by_second[one.second]
    ]
    chosen: list[Passing] = []
    for one in sorted(near, key=lambda it: it.distance_m):
        if not any(_is_same(one, other) for other in chosen):
            chosen.append(one)
        if len(chosen) == PASSES_SHOWN:
            break
    return chosen


def _passing(pose: Pose, one: DaySighting, greenhouse: Greenhouse) -> Passing:
    return Passing(
        at=float(pose.second),
        robot_id=pose.robot_id,
        distance_m=hypot(pose.x - one.x, pose.y - one.y),
        speed=abs(pose.speed),
        lane=greenhouse.lane_at(one.x, one.y),
    )


def _is_same(one: Passing, other: Passing) -> bool:
    return one.robot_id == other.robot_id and abs(one.at - other.at) < _APART_S
