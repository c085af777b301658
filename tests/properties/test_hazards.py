"""Near by arrays is near one by one: the same speed limits, names and order of all."""

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.rule import zones
from iveg.domain.rule.crossings import LimitChange
from tests.builders import at
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


DRIFTS = st.lists(
    st.tuples(
        st.sampled_from([0.0, 0.01, 0.01, 0.1, 0.45, 11.0]),
        st.sampled_from(FLEET[:3]),
        st.tuples(st.integers(-16, 16), st.integers(-3, 3)),
        st.lists(st.tuples(st.integers(-16, 16), st.integers(-3, 3)), max_size=2),
    ),
    min_size=1,
    max_size=25,
)
"""The same in quarters of a metre, all within a few metres of one another."""


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


Steps = list[tuple[float, str, tuple[int, int], list[tuple[int, int]]]]


def play(steps: Steps, metre: float = 2.0) -> list[object]:
    scene, told = Scene(FLEET), list[object]()
    for pause, robot_id, (x, y), seen in steps:
        scene.now += pause
        scene.drive(robot_id, x / metre, y / metre)
        scene.look(robot_id, *(person(px / metre, py / metre) for px, py in seen))
        told.append((scene.judge(), named(scene.changes), scene.everyone))
    return told


def assert_alike(steps: Steps, metre: float) -> None:
    """The rule finds the same whether it looks at each or only at who is near."""
    with pytest.MonkeyPatch.context() as one_by_one:
        one_by_one.setattr(zones, "_FEW_PAIRS", 10**9)
        expected = play(steps, metre)
    with pytest.MonkeyPatch.context() as arrays:
        arrays.setattr(zones, "_FEW_PAIRS", -1)
        found = play(steps, metre)
    assert found == expected


@given(STEPS)
def test_arrays_find_what_looking_at_each_finds(steps: Steps) -> None:
    assert_alike(steps, 2.0)


@given(DRIFTS)
def test_neighbours_of_half_a_second_ago_are_all_that_looking_at_each_finds(
    steps: Steps,
) -> None:
    assert_alike(steps, 4.0)


WAITS = st.lists(st.sampled_from([0.0, 0.05, 0.2, 0.31, 1.0, 2.7]), max_size=3)


@given(DRIFTS, WAITS, st.sampled_from([-1, 10**9]))
def test_judging_anew_only_whose_premises_changed_is_judging_everybody(
    steps: Steps, waits: list[float], few_pairs: int
) -> None:
    scene = Scene(FLEET)
    with pytest.MonkeyPatch.context() as compared:
        compared.setattr(zones, "_FEW_PAIRS", few_pairs)
        for pause, robot_id, (x, y), seen in steps:
            scene.now += pause
            scene.drive(robot_id, x / 4, y / 4)
            scene.look(robot_id, *(person(px / 4, py / 4) for px, py in seen))
            scene.navigate(robot_id, "hauling" if x > y else "scouting")
            for wait in (0.0, *waits):
                scene.now += wait
                afresh = scene.speed_limits.copy()
                known = scene.world, scene.people, scene.rule, at(scene.now), "d"
                expected = afresh.evaluate(*known)
                found = scene.speed_limits.evaluate(*known)
                assert found == expected
                assert scene.speed_limits.crossings == afresh.crossings
                assert scene.speed_limits.limited_since == afresh.limited_since


def test_a_peer_that_comes_back_where_it_was_lost_is_found() -> None:
    both: Steps = [(0.0, "R0", (0, 0), []), (0.1, "R1", (0, 4), [])]
    alone: Steps = [(10.9, "R0", (0, 0), []), (1.5, "R0", (0, 0), [])]
    assert_alike([*both, *alone, (0.1, "R1", (0, 4), [])], 4.0)
