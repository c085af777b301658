"""Evening sheet: one day of the fleet in a few numbers, from the history alone.

Poses are means over a second.  A person and a robot move within that second, so the
distance of a pass is exact to about half a metre.
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
"""Time within which passes of a robot count as the same pass (s)."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Mean position (``map``, m) and speed (m/s) of a robot in a second (Unix s)."""

    robot_id: str
    second: int
    x: float
    y: float
    speed: float


@dataclass(frozen=True, slots=True)
class DaySighting:
    """Mean position of a person (``map``, m) in a second (Unix s)."""

    second: int
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Passing:
    """A robot near a person.

    Attributes:
        at: Time of the pass (Unix s).
        distance_m: Distance between the middles of both (m).
        speed: Speed of the robot (m/s).
        lane: Label of the person's aisle; None: in none.
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
        slowed: Number of encounters in which the robot reported a slow factor.
    """

    count: int = 0
    slowed: int = 0


def encounter_counts(decisions: Iterable[DecisionRecord]) -> EncounterCounts:
    """Counts of the encounters with people among these decisions."""
    encounters = [
        row for row in decisions if row.kind == "mandate" and row.reason == "person"
    ]
    return EncounterCounts(
        len(encounters), sum(row.applied_at is not None for row in encounters)
    )


def worked_minutes(
    poses: Iterable[Pose], greenhouse: Greenhouse
) -> dict[str, dict[str, float]]:
    """Minutes of driving, by aisle and robot."""
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
    """Minutes of slowed robots, by cause and aisle of the cause.

    Args:
        decisions: Decisions of the day.
        greenhouse: Greenhouse with its aisles.
        until: Time at which a slow-down without an end is cut off (Unix s).
    """
    spans: dict[tuple[str, str | None, str], list[tuple[float, float]]]
    spans = defaultdict(list)
    for row in decisions:
        if row.kind != "mandate":
            continue
        known = row.x is not None and row.y is not None
        lane = greenhouse.lane_at(row.x or 0.0, row.y or 0.0) if known else None
        key = row.reason or "", lane, row.robot_id
        end = until if row.ended_at is None else min(row.ended_at, until)
        spans[key].append((row.started_at, end))
    minutes: dict[tuple[str, str | None], float] = defaultdict(float)
    # Decisions of a robot overlap where several people slow it: a minute counts once.
    for (reason, lane, _), slowed in spans.items():
        minutes[reason, lane] += length(slowed) / 60.0
    return dict(minutes)


def length(spans: Iterable[tuple[float, float]]) -> float:
    """Length of the union of spans (s)."""
    total, covered = 0.0, float("-inf")
    for start, end in sorted(spans):
        total += max(0.0, end - max(start, covered))
        covered = max(covered, end)
    return total


def closest_passes(
    poses: Sequence[Pose], sightings: Iterable[DaySighting], greenhouse: Greenhouse
) -> list[Passing]:
    """The closest passes of moving robots near people, nearest first."""
    by_second: dict[int, list[Pose]] = defaultdict(list)
    for pose in poses:
        # A standing robot passes nobody.
        if abs(pose.speed) >= LIMITS.standing_speed:
            by_second[pose.second].append(pose)
    passes = [
        Passing(
            at=float(pose.second),
            robot_id=pose.robot_id,
            distance_m=hypot(pose.x - person.x, pose.y - person.y),
            speed=abs(pose.speed),
            lane=greenhouse.lane_at(person.x, person.y),
        )
        for person in sightings
        for pose in by_second[person.second]
    ]
    closest: list[Passing] = []
    for passing in sorted(passes, key=lambda passing: passing.distance_m):
        is_known = any(
            passing.robot_id == other.robot_id and abs(passing.at - other.at) < _APART_S
            for other in closest
        )
        if not is_known:
            closest.append(passing)
        if len(closest) == PASSES_SHOWN:
            break
    return closest
