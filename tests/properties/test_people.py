"""People under noise: one stays one, two stay two, and nobody loses protection."""

import random

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.limits import LIMITS
from tests.builders import at
from tests.unit.domain.scene import Scene, person

places = st.tuples(st.floats(-20, 20), st.floats(-20, 20))
looks = st.lists(
    st.tuples(st.sampled_from(["AGI", "AGII"]), st.floats(0.0, 1.5), places),
    min_size=1,
    max_size=40,
)
RUNS, LOOKS, NOISE_M = 300, 40, 0.2


def _people_of_one_run(seed: int) -> int:
    """Two robots look at one standing person for two seconds, ten times a second."""
    rng, scene = random.Random(seed), Scene()  # noqa: S311 - noise, not a secret
    for number in range(LOOKS):
        scene.now = number * 0.05
        seen = person(rng.gauss(3.0, NOISE_M), rng.gauss(0.0, NOISE_M))
        scene.look(scene.robots[number % 2], seen)
    return len(scene.everyone)


def test_one_person_seen_by_two_noisy_robots_stays_one_in_99_of_100_runs() -> None:
    ones = sum(_people_of_one_run(seed) == 1 for seed in range(RUNS))

    assert ones / RUNS >= 0.99


@given(looks)
def test_every_robots_newest_look_keeps_its_ring(
    seen: list[tuple[str, float, tuple[float, float]]],
) -> None:
    scene = Scene()
    newest: dict[str, tuple[float, tuple[float, float]]] = {}
    for observer, pause, place in seen:
        scene.now += pause
        scene.look(observer, person(*place))
        newest[observer] = scene.now, place

    rings = [
        (sighting.observer, round(sighting.x, 6), round(sighting.y, 6))
        for one in scene.everyone
        for sighting, radius in one.zone_radii(scene.rule, at(scene.now))
        if radius >= 2.0
    ]
    for observer, (when, (x, y)) in newest.items():
        if scene.now - when <= LIMITS.zone_lasts_s:
            assert (observer, round(x, 6), round(y, 6)) in rings


@given(st.lists(places, min_size=1, max_size=12))
def test_everybody_in_one_look_is_somebody_else(
    seen: list[tuple[float, float]],
) -> None:
    scene = Scene()
    for _ in range(2):
        scene.look("AGI", *(person(*place) for place in seen))
        scene.now += 0.1

    assert len(scene.everyone) == len(seen)


@given(looks)
def test_a_look_is_counted_for_one_person_alone(
    seen: list[tuple[str, float, tuple[float, float]]],
) -> None:
    scene = Scene()
    for observer, pause, place in seen:
        scene.now += pause
        (placed,) = scene.look(observer, person(*place))
        assert placed.person is not None
        look = next(
            one for one in reversed(placed.person.sightings) if one.observer == observer
        )
        holders = [one for one in scene.everyone if look in one.sightings]
        assert [one.person_id for one in holders] == [placed.person.person_id]
