"""Looks that add up only ever add protection (docs/safety.md, "The rule")."""

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from tests.builders import at, detection
from tests.unit.domain.scene import Scene

_PICTURE = st.lists(
    st.tuples(
        # No place is as far from one as from another, so that no pairing is a toss-up.
        st.sampled_from((1.0, 1.83, 2.57, 6.0)),
        st.sampled_from((0.3, 0.5, 0.62, 0.72, 0.79, 0.8, 0.95)),
    ),
    max_size=3,
    unique_by=lambda one: one[0],
)
_STEP = st.tuples(
    st.sampled_from((0.1, 0.3, 0.3, 1.2)), st.sampled_from(("AGI", "AGII")), _PICTURE
)
_ROBOTS = {"AGI": 0.0, "AGII": 3.1}


def rings_of(scene: Scene) -> set[tuple[float, float]]:
    """Where every ring lies, and how wide it is."""
    return {
        (one.x, round(radius, 6))
        for person in scene.everyone
        for one, radius in person.zone_radii(scene.rule, at(scene.now))
    }


@given(st.lists(_STEP, max_size=16))
def test_every_ring_of_the_boxes_alone_is_there_and_no_robot_is_ever_faster(
    run: list[tuple[float, str, list[tuple[float, float]]]],
) -> None:
    single = Scene(rule=DetectionRule(possible_people=False))
    summed = Scene(rule=DetectionRule())
    for after_s, observer, picture in run:
        limits = []
        for scene in (single, summed):
            scene.now = round(scene.now + after_s, 6)
            for robot_id, x in _ROBOTS.items():
                scene.drive(robot_id, x)
            seen = [detection("farmer", x, probability=p) for x, p in picture]
            scene.look(observer, *seen)
            limits.append(scene.judge())
        assert rings_of(single) <= rings_of(summed)
        before, after = limits
        for robot_id, limit in before.items():
            assert after[robot_id].speed_factor <= limit.speed_factor
