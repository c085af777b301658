"""Looks that add up only ever add protection (docs/safety.md, "The rule")."""

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from tests.builders import detection
from tests.unit.domain.scene import Scene

_PICTURE = st.lists(
    st.tuples(
        st.sampled_from((1.0, 1.8, 2.5, 6.0)),
        st.sampled_from((0.4, 0.5, 0.62, 0.72, 0.79, 0.8, 0.95)),
    ),
    max_size=3,
)


@given(st.lists(st.tuples(st.sampled_from((0.1, 0.3, 1.2)), _PICTURE), max_size=12))
def test_no_robot_is_ever_faster_for_them(
    run: list[tuple[float, list[tuple[float, float]]]],
) -> None:
    single = Scene(rule=DetectionRule(possible_people=False))
    summed = Scene(rule=DetectionRule(possible_people=True))
    for after_s, picture in run:
        limits = []
        for scene in (single, summed):
            scene.now = round(scene.now + after_s, 6)
            scene.drive("AGI", 0.0)
            scene.drive("AGII", 3.0)
            seen = [detection("farmer", x, probability=p) for x, p in picture]
            scene.look("AGI", *seen)
            limits.append(scene.judge())
        before, after = limits
        for robot_id, limit in before.items():
            assert after[robot_id].speed_factor <= limit.speed_factor
