"""Speed limits under noise: they never flap, never multiply, and none is forgotten."""

import itertools
import math

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.limits import LIMITS
from tests.unit.domain.scene import Scene, person

noise = st.lists(st.floats(-0.149, 0.149), min_size=60, max_size=60)
steps = st.lists(
    st.tuples(st.floats(0.0, 6.0), st.sampled_from([0.1, 0.3])),
    min_size=1,
    max_size=60,
)


def step(scene: Scene, distance: float) -> float:
    """AGI stands, somebody is seen at a distance; AGI's factor."""
    scene.drive("AGI", 0.0)
    scene.drive("AGII", 50.0)
    scene.look("AGI", person(distance))
    scene.look("AGII")
    return scene.judge()["AGI"].speed_factor


def changes(factors: list[float]) -> int:
    return sum(a != b for a, b in itertools.pairwise(factors))


@given(noise)
def test_a_noisy_crossing_out_is_one_change(wobble: list[float]) -> None:
    scene, factors = Scene(), []
    for number, jitter in enumerate(wobble):
        scene.now = number / 10
        factors.append(step(scene, 1.5 + 0.03 * number + jitter))

    assert factors[0] == 0.5
    assert changes(factors) <= 1


@given(noise)
def test_a_noisy_crossing_in_is_one_change(wobble: list[float]) -> None:
    scene, factors = Scene(), []
    for number, jitter in enumerate(wobble):
        scene.now = number / 10
        factors.append(step(scene, 3.0 - 0.03 * number + jitter))

    assert factors[-1] == 0.5
    assert changes(factors) <= 1


@given(noise)
def test_standing_at_the_border_is_one_change_at_most(wobble: list[float]) -> None:
    scene, factors = Scene(), []
    for number, jitter in enumerate(wobble):
        scene.now = number / 10
        factors.append(step(scene, 2.0 + jitter))

    assert changes(factors) <= 1


@given(steps)
def test_inside_a_ring_the_factor_is_a_half_at_once(
    walked: list[tuple[float, float]],
) -> None:
    scene = Scene()
    for distance, pause in walked:
        scene.now += pause
        factor = step(scene, distance)
        assert factor in (0.5, 1.0)
        assert factor == 0.5 or distance > 2.0


@given(steps)
def test_nothing_is_let_go_before_a_second_outside_the_wider_ring(
    walked: list[tuple[float, float]],
) -> None:
    scene, factor, outside_since = Scene(), 1.0, 0.0
    for distance, pause in walked:
        scene.now += pause
        before, factor = factor, step(scene, distance)
        if distance <= 2.0 + LIMITS.release_beyond_m:
            outside_since = math.inf
        elif outside_since == math.inf:
            outside_since = scene.now
        if (before, factor) == (0.5, 1.0):
            assert scene.now - outside_since >= LIMITS.release_after_s - 1e-9


@given(st.lists(st.floats(-1.9, 1.9), min_size=1, max_size=8))
def test_any_number_of_rings_is_half_speed(people: list[float]) -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.drive("AGII", 1.0)
    scene.look("AGII")
    scene.look("AGI", *(person(0.0, y) for y in people))

    assert scene.judge()["AGI"].speed_factor == 0.5
