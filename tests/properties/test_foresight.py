"""Foresight only adds (docs/safety.md, "Foresight")."""

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.detection_rule import DetectionRule
from tests.unit.domain.scene import Scene, person

_SPOT = st.tuples(
    st.sampled_from((-3.0, 1.5, 2.4, 3.0, 4.5, 7.0)),
    st.sampled_from((-2.0, 0.0, 0.5, 2.5)),
)
_STEP = st.tuples(
    st.sampled_from((0.1, 0.4, 1.2)),
    st.sampled_from((-1.0, 0.0, 0.4, 1.0)),
    st.lists(_SPOT, max_size=2),
)


@given(st.lists(_STEP, max_size=15))
def test_no_robot_is_ever_faster_for_it(
    run: list[tuple[float, float, list[tuple[float, float]]]],
) -> None:
    scenes = [Scene(rule=DetectionRule(foresight=one)) for one in (False, True)]
    x = 0.0
    for after_s, speed, people in run:
        x += speed * after_s
        limits = []
        for scene in scenes:
            scene.now = round(scene.now + after_s, 6)
            scene.drive("AGI", x, linear=speed)
            scene.drive("AGII", 3.0, 1.0, linear=-speed)
            scene.look("AGI", *(person(*spot) for spot in people))
            scene.look("AGII")
            limits.append(scene.judge())
        before, after = limits
        for robot_id, limit in before.items():
            assert after[robot_id].speed_factor <= limit.speed_factor
