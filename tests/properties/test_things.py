"""A mark "not a person here" changes nothing for anybody but the thing."""

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.tracking.things import RADIUS_M, SURELY_FROM, Thing
from tests.builders import at
from tests.unit.domain.scene import Scene, person

_X = 5.0
_COAT = Thing("T1", _X, 0.0, "ana", at(0.0), at(1000.0))
_STEP = st.tuples(
    st.sampled_from(("AGI", "AGII")),
    st.booleans(),
    st.sampled_from((-0.15, 0.0, 0.15)),
    # Too faint for anything, or sure alone: what looks add is in ``test_looks``.
    st.sampled_from((0.2, 0.8, 0.94, 0.95)),
)
"""Who looks, whether the coat is seen, the walker's step (m), and how sure."""

Rings = set[tuple[float, float, str, float]]
"""Place, confidence, observer and radius of each."""


def rings_of(scene: Scene) -> Rings:
    return {
        (one.x, one.confidence, one.observer, radius)
        for somebody in scene.everyone
        for one, radius in scene.people.zone_radii(somebody, scene.rule, at(scene.now))
    }


def taken(
    run: list[tuple[str, bool, float, float]], walker: float
) -> list[tuple[float, Rings, Rings]]:
    """Where the walker is at each step, and the rings without and with the mark."""
    plain, marked = Scene(), Scene()
    marked.people.things.known["T1"] = _COAT
    out = []
    for observer, has_coat, step, confidence in run:
        walker = round(walker + step, 6)
        seen = [person(walker, probability=confidence)]
        if has_coat:
            seen.append(person(_X, 0.01, probability=0.85))
        for scene in (plain, marked):
            scene.now = round(scene.now + 0.1, 6)
            for robot_id in scene.robots:
                scene.drive(robot_id, 0.0)
            scene.look(observer, *seen)
        out.append((walker, rings_of(plain), rings_of(marked)))
    return out


@given(st.lists(_STEP, max_size=30), st.sampled_from((4.4, 4.0, 5.6, 6.5)))
def test_who_came_from_outside_has_a_ring_wherever_they_had_one(
    run: list[tuple[str, bool, float, float]], start: float
) -> None:
    last = None
    for walker, without, with_mark in taken(run, start):
        assert with_mark <= without
        for x, confidence, *_ in without - with_mark:
            assert abs(x - _X) <= RADIUS_M
            assert confidence < SURELY_FROM
        is_known = last is not None or abs(walker - _X) > RADIUS_M
        if is_known and any(x == walker for x, *_ in without):
            last = walker
        # The tracker may take the coat for the walker: then the coat has their ring.
        near = [
            min(abs(x - _X), abs(x - last) / 2) <= RADIUS_M
            for x, *_ in with_mark
            if last is not None
        ]
        assert any(near) or last is None


@given(
    st.lists(_STEP, min_size=1, max_size=30),
    st.sampled_from((4.6, 5.0, 5.4)),
)
def test_who_was_surely_seen_or_left_the_circle_once_has_every_ring_from_then_on(
    run: list[tuple[str, bool, float, float]], start: float
) -> None:
    alone = [(observer, False, step, sure) for observer, _, step, sure in run]
    is_somebody = False
    for (walker, without, with_mark), (*_, sure) in zip(
        taken(alone, start), alone, strict=True
    ):
        is_out = abs(walker - _X) > RADIUS_M + 1e-6
        counts = any(abs(x - walker) < 1e-6 for x, *_ in without)
        is_somebody |= counts and (sure >= SURELY_FROM or is_out)
        assert not is_somebody or with_mark == without
