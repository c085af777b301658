"""What no robot or detector should say: doubt or a bound, never a higher factor.

Plans are in ``test_foresight``, lasers in ``test_obstacles`` and ``test_witness``.
"""

import pytest

from tests.unit.domain.scene import Scene, person


@pytest.mark.parametrize("speed", [3.0, 50.0, 1e9, -50.0])
def test_a_twist_above_the_profile_frees_nobody_and_ends_no_slow_down(
    speed: float,
) -> None:
    scene, factors = Scene(("AGI", "AGII")), []
    for tenth in range(40):
        scene.now = tenth / 10
        lies = tenth >= 10
        scene.drive("AGI", 0.05 * min(tenth, 10), linear=speed if lies else 0.5)
        scene.drive("AGII", 50.0)
        scene.look("AGI", person(1.9))
        scene.look("AGII")
        factors.append(scene.judge()["AGI"].speed_factor)
    assert set(factors) == {0.5}


@pytest.mark.parametrize("speed", [50.0, 1e9, -50.0])
def test_a_robot_with_such_a_twist_is_slow_though_nobody_is_near(speed: float) -> None:
    scene = Scene()
    for tenth in range(20):
        scene.now = tenth / 10
        scene.drive("AGI", 0.0, linear=speed)
        scene.drive("AGII", 50.0, 60.0, linear=0.0)
        scene.look("AGI")
        scene.look("AGII")
        limit = scene.judge()["AGI"]
    assert (limit.speed_factor, limit.reason) == (0.5, "doubt")
