"""Another robot's word only ever adds zones (docs/safety.md, "Age")."""

from hypothesis import example, given
from hypothesis import strategies as st

from tests.builders import at
from tests.unit.domain.scene import Scene, person

_PLACES = st.sampled_from((1.5, 2.4, 3.3, 6.0))
_BOXES = st.lists(
    st.tuples(_PLACES, st.sampled_from((0.3, 0.7, 0.85, 0.95))),
    max_size=2,
    unique_by=lambda one: one[0],
)
_OBSTACLES = st.none() | st.tuples(_PLACES, st.booleans())
_STEP = st.tuples(st.sampled_from((0.1, 0.3, 1.2)), _BOXES, _BOXES, _OBSTACLES)
"""How long it takes, what AGI sees, and what AG3 says: its boxes, its laser."""
_ROBOTS = {"AGI": 0.0, "AGII": 4.5}
Boxes = list[tuple[float, float]]
Step = tuple[float, Boxes, Boxes, tuple[float, bool] | None]
_WALKER: list[Step] = [(0.1, [(3.3, 0.95)], [], None)]
_EMPTY: list[Step] = [(0.1, [], [], None)] * 25


def zones(scene: Scene, observer: str) -> set[tuple[float, float, float]]:
    """Place, moment and width of each zone of an observer."""
    return {
        (one.x, one.at.mono, round(radius, 6))
        for somebody in scene.everyone
        for one, radius in scene.people.zone_radii(somebody, scene.rule, at(scene.now))
        if one.observer == observer
    }


@given(st.lists(_STEP, max_size=25))
# A faint look joins a track that another robot's laser began.
@example(
    [
        (0.1, [], [(1.5, 0.85)], None),
        *_EMPTY[:4],
        (0.1, [], [], (3.3, True)),
        (0.1, [(1.5, 0.85), (3.3, 0.85)], [], None),
        (0.1, [(3.3, 0.3)], [], None),
        (0.1, [(2.4, 0.85)], [], None),
    ]
)
@example(_WALKER + _EMPTY)
# Two are equally near, and another robot knew the second first.
@example(
    [
        (0.1, [], [(1.5, 0.85)], None),
        (0.1, [(3.3, 0.85), (1.5, 0.85)], [], None),
        (0.1, [(2.4, 0.85)], [], None),
    ]
)
@example([*_WALKER, *((0.1, [], [], (3.3, moved)) for moved in (False, True) * 12)])
def test_another_observer_ends_no_zone_of_somebody_else_and_makes_nobody_faster(
    run: list[Step],
) -> None:
    alone, beside = Scene(), Scene(robots=("AGI", "AGII", "AG3"))
    for after_s, seen, said, obstacle in run:
        limits = []
        for scene in (alone, beside):
            scene.now = round(scene.now + after_s, 6)
            for robot_id, x in _ROBOTS.items():
                scene.drive(robot_id, x)
            scene.look("AGI", *(person(x, probability=p) for x, p in seen))
            scene.look("AGII")
            if scene is beside:
                scene.drive("AG3", 0.0, 0.5, linear=0.0)
                scene.look("AG3", *(person(x, probability=p) for x, p in said))
                if obstacle is not None:
                    scene.walks_by("AG3", obstacle[0], moved=obstacle[1])
            limits.append(scene.judge())
        assert zones(alone, "AGI") <= zones(beside, "AGI")
        before, after = limits
        for robot_id, limit in before.items():
            assert after[robot_id].speed_factor <= limit.speed_factor
