"""Near by arrays is near one by one: the same speed limits, names and order of all."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.parameters import ByClass
from iveg.domain.robot_state import RobotState
from iveg.domain.rule import judge
from iveg.domain.rule.zones import Distance, Distances, LimitChange, Zone
from tests.unit.domain.scene import Scene, person

FLEET = tuple(f"R{number}" for number in range(6))
PLACES = st.tuples(st.integers(-40, 40), st.integers(-40, 40))
STEPS = st.lists(
    st.tuples(
        st.sampled_from([0.0, 0.03, 0.4, 1.1, 4.0, 11.0]),
        st.sampled_from(FLEET),
        PLACES,
        st.lists(PLACES, max_size=6),
    ),
    min_size=1,
    max_size=25,
)
"""Pause (s), which robot moves and looks, to where, and whom it sees."""


def named(changes: Iterable[LimitChange]) -> list[tuple[object, ...]]:
    return [
        (
            one.began,
            one.entry.decision_id,
            one.entry.robot_id,
            one.entry.zone,
        )
        for one in changes
    ]


Steps = list[tuple[float, str, tuple[int, int], list[tuple[int, int]]]]


RULE = DetectionRule(radius_m=ByClass(2.0, {"robot": 3.0}))
"""Robots have wider zones than people."""


def play(steps: Steps, metre: float) -> list[object]:
    scene, told = Scene(FLEET, rule=RULE), list[object]()
    for pause, robot_id, (x, y), seen in steps:
        scene.now += pause
        scene.drive(robot_id, x / metre, y / metre)
        scene.look(robot_id, *(person(px / metre, py / metre) for px, py in seen))
        told.append((scene.judge(), named(scene.changes), scene.everyone))
    return told


def one_by_one(
    robots: Iterable[RobotState],
    zones: Sequence[Zone],
    entries: Mapping[str, Container[str]],
) -> Iterator[tuple[RobotState, Distances]]:
    """Every robot with the zones that it is in or was in, each looked at alone."""
    for robot in robots:
        if robot.odometry is not None:
            pose, mine = robot.odometry.pose, entries.get(robot.robot_id, ())
            near: Distances = {}
            for zone in zones:
                centre_m = pose.distance_to(zone.x, zone.y)
                one = Distance(centre_m - zone.radius_m, centre_m, zone)
                is_near = zone.cause in mine or one.outside_m <= 0.01
                if is_near and zone.cause != robot.robot_id:
                    known = near.get(zone.cause, one)
                    near[zone.cause] = min(known, one, key=lambda one: one.outside_m)
            yield robot, near


@given(STEPS, st.sampled_from((2.0, 8.0)))
def test_arrays_find_what_looking_at_each_finds(steps: Steps, metre: float) -> None:
    """The rule finds the same whether it looks at all or only at what is near."""
    with pytest.MonkeyPatch.context() as compared:
        compared.setattr(judge, "distances_to_zones", one_by_one)
        expected = play(steps, metre)
    assert play(steps, metre) == expected
