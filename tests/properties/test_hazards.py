"""Near by arrays is near one by one: the same speed limits, names and order of all."""

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.rule import zones
from iveg.domain.rule.speed_limits import LimitChange
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
"""Pause (s), who moves and looks, to where, and whom it sees (half metres)."""


def named(changes: Iterable[LimitChange]) -> list[tuple[object, ...]]:
    return [
        (
            one.began,
            one.crossing.decision_id,
            one.crossing.robot_id,
            one.crossing.zone,
        )
        for one in changes
    ]


def play(
    steps: list[tuple[float, str, tuple[int, int], list[tuple[int, int]]]],
) -> list[object]:
    scene, told = Scene(FLEET), list[object]()
    for pause, robot_id, (x, y), seen in steps:
        scene.now += pause
        scene.drive(robot_id, x / 2, y / 2)
        scene.look(robot_id, *(person(px / 2, py / 2) for px, py in seen))
        told.append((scene.judge(), named(scene.changes), scene.everyone))
    return told


@given(STEPS)
def test_arrays_find_what_looking_at_each_finds(
    steps: list[tuple[float, str, tuple[int, int], list[tuple[int, int]]]],
) -> None:
    with pytest.MonkeyPatch.context() as one_by_one:
        one_by_one.setattr(zones, "_FEW_PAIRS", 10**9)
        expected = play(steps)
    with pytest.MonkeyPatch.context() as arrays:
        arrays.setattr(zones, "_FEW_PAIRS", -1)
        found = play(steps)
    assert found == expected
