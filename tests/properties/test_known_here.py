"""Known places take reason ``obstacle`` away of what is static, and nothing else."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D
from iveg.domain.known import KnownPlace
from iveg.domain.observations import LaserScan, Origin
from iveg.domain.rule.known_here import KnownHere
from iveg.domain.tracking.things import Thing
from tests.builders import at
from tests.unit.domain.scene import HEDGE, Scene
from tests.unit.domain.scene import person as camera

BEAMS = 180
_PLACES = (
    KnownPlace(2.45, 0.0, 0.3, 0.5),
    KnownPlace(2.42, 1.0, 0.3, 0.5),
    KnownPlace(1.6, -0.8, 0.5),
)
"""Two beside the hedge at x = 2.9, and one in the aisle that an operator marked."""
_SPOT = st.sampled_from([(one.x, one.y) for one in _PLACES])
_MOVE = st.tuples(st.floats(-0.12, 0.12), st.floats(-0.12, 0.12))
_MOMENT = st.tuples(
    st.sampled_from((0.0, 0.3)),
    st.lists(_MOVE, min_size=3, max_size=3),
    st.lists(st.booleans(), min_size=3, max_size=3),
    st.lists(_SPOT, max_size=1),
)
Moment = tuple[float, list[tuple[float, float]], list[bool], list[tuple[float, float]]]


class Told(KnownHere):
    """Everything is known already."""

    def near(self, *_: object) -> tuple[KnownPlace, ...]:
        return _PLACES


class Pair:
    """The same run twice; in the second, places are known."""

    def __init__(self) -> None:
        self.plain, self.knowing = Scene(greenhouse=HEDGE), Scene(greenhouse=HEDGE)
        things = self.knowing.people.things
        self.knowing.obstacles.known_here = Told(things)

    def step(self, x: float, speed: float) -> None:
        for scene in (self.plain, self.knowing):
            scene.now = round(scene.now + 0.1, 6)
            scene.drive("AGI", x, linear=speed)
            scene.drive("AGII", -20.0, linear=0.0)

    @property
    def both(self) -> tuple[Scene, Scene]:
        return self.plain, self.knowing


@given(
    st.lists(_SPOT, min_size=3, max_size=3),
    st.lists(st.booleans(), min_size=3, max_size=3),
    st.lists(_MOMENT, min_size=3, max_size=25),
)
def test_rings_stay_and_factors_rise_for_what_is_static_alone(
    bodies: list[tuple[float, float]], moving: list[bool], run: list[Moment]
) -> None:
    pair, x = Pair(), 0.0
    for speed, moves, shown, boxes in run:
        x += 0.1 * speed
        bodies = [
            (at_x + dx * moves_on, at_y + dy * moves_on)
            for (at_x, at_y), (dx, dy), moves_on in zip(
                bodies, moves, moving, strict=True
            )
        ]
        pair.step(x, speed)
        said = _sweep(
            x, [one for one, is_on in zip(bodies, shown, strict=True) if is_on]
        )
        for scene in pair.both:
            scene.look("AGI", *(camera(*one) for one in boxes))
            scene.look("AGII")
            scene.scan("AGI", said)
        before, after = (scene.judge()["AGI"] for scene in pair.both)
        assert _rings(pair.plain) == _rings(pair.knowing)
        assert after.speed_factor >= before.speed_factor
        if after.speed_factor > before.speed_factor:
            assert before.reason == "obstacle"
        _check_what_is_explained(pair)


def _check_what_is_explained(pair: Pair) -> None:
    plain, knowing = (one.obstacles._witnesses["AGI"] for one in pair.both)
    assert plain.walkers == knowing.walkers
    now = pair.plain.now + 1000.0
    left = knowing.present(now)
    for one in plain.present(now):
        if one in left:
            continue
        assert not one.is_somebody
        assert one.most_way_m <= 0.4
        assert any(
            one.around.farthest_m(place.x, place.y) <= place.radius_m
            for place in _PLACES
        )


def _rings(scene: Scene) -> set[tuple[str, float, float, float]]:
    now = at(scene.now)
    return {
        (person.person_id, one.x, one.y, radius)
        for person in scene.everyone
        for one, radius in scene.people.rings(person, scene.rule, now)
    }


def _sweep(x: float, bodies: list[tuple[float, float]]) -> LaserScan:
    """What a robot at x measures of the hedge before it and of small bodies."""
    bearings = -math.pi + math.tau / BEAMS * np.arange(BEAMS)
    towards = np.cos(bearings)
    with np.errstate(divide="ignore"):
        ranges = np.where(towards > 0.2, (2.9 - x) / towards, np.inf)
    for at_x, at_y in bodies:
        away = math.hypot(at_x - x, at_y)
        off = np.angle(np.exp(1j * (bearings - math.atan2(at_y, at_x - x))))
        ranges = np.where(np.abs(off) <= 0.06, np.minimum(ranges, away), ranges)
    here = Pose2D(0.0, 0.0, 0.0)
    told = ranges.astype(np.float32)
    return LaserScan("AGI", Origin(), -math.pi, math.tau / BEAMS, 0.1, 30.0, here, told)


@given(st.lists(st.tuples(_MOVE, st.booleans()), max_size=40))
def test_a_mark_ends_where_something_moves_and_never_comes_back(
    run: list[tuple[tuple[float, float], bool]],
) -> None:
    scene = Scene(greenhouse=HEDGE)
    mark = Thing("T1", 1.6, -0.8, "ana", at(0.0), at(9000.0), "obstacle")
    scene.people.things.add(mark)
    x, y, is_over = 1.6, -0.8, False
    for (dx, dy), moves in run:
        x, y = (x + dx, y + dy) if moves else (x, y)
        scene.now = round(scene.now + 0.1, 6)
        scene.drive("AGI", 0.0, linear=0.0)
        scene.scan("AGI", replace(_sweep(0.0, [(x, y)])))
        witness = scene.obstacles._witnesses["AGI"]
        stirred = [one for one in witness.newest if one.stirred]
        near = [one for one in stirred if math.dist((one.x, one.y), (1.6, -0.8)) <= 0.5]
        is_over |= bool(near)
        left = scene.people.things.obstacles_at(at(scene.now))
        assert not (is_over and left)
