"""Issue 13.22: the evening sheet, from the history alone."""

import pytest

from iveg.domain.day import (
    DaySighting,
    EncounterCounts,
    Pose,
    closest_passes,
    encounter_counts,
    slowed_minutes,
)
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from tests.fakes.records import NOON, decision_record

GREENHOUSE = Greenhouse(
    "two aisles",
    Rectangle(0, 0, 20, 10),
    lanes=(
        DriveLane("1", Rectangle(0, 0, 20, 4)),
        DriveLane("2", Rectangle(0, 6, 20, 10)),
    ),
)


def pose(second: int, x: float = 1.0, y: float = 2.0, speed: float = 0.5) -> Pose:
    return Pose("AGI", second, x, y, speed)


def test_a_robot_slowed_twice_at_once_is_slowed_once() -> None:
    overlapping = [
        decision_record(
            decision_id=f"D{start}",
            x=1.0,
            y=7.0,
            reason="person",
            started_at=NOON + start,
            ended_at=NOON + start + 60.0,
        )
        for start in (0.0, 30.0)
    ]

    minutes = slowed_minutes(overlapping, GREENHOUSE, NOON + 1000.0)
    assert minutes == {("person", "2"): pytest.approx(1.5)}

    goes_on = decision_record(x=1.0, y=1.0, reason="person", started_at=NOON)
    assert slowed_minutes([goes_on], GREENHOUSE, NOON + 30.0) == {("person", "1"): 0.5}


def test_encounters_are_those_with_people_and_say_how_they_went() -> None:
    met = {"kind": "mandate", "reason": "person"}
    day = [
        decision_record(**met, applied_at=NOON + 0.2),
        decision_record(**met),
        decision_record(kind="mandate", reason="robot", applied_at=NOON + 0.2),
    ]

    assert encounter_counts(day) == EncounterCounts(count=2, slowed=1)


def test_the_closest_passes_are_of_moving_robots_and_not_one_pass_told_thrice() -> None:
    poses = [pose(10), pose(11, x=1.5), pose(200, x=4.0), pose(400, speed=0.0)]
    seen = [DaySighting(second, 2.0, 2.0) for second in (10, 11, 200, 400)]

    found = closest_passes(poses, seen, GREENHOUSE)

    assert [(one.at, one.distance_m) for one in found] == [(11.0, 0.5), (200.0, 2.0)]
    assert found[0].lane == "1"
