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
