"""A robot deaf to feedback is accused at each person that it passes too fast.

Its own reports say all the while that it applies half speed.
"""

import pytest

from iveg.domain.robot_state import allowed_s, slow_below
from tests.faulty_world import Faults
from tests.stage import Stage

DEAF = "AGII"
STEPS = 1150
"""It passes the same person twice."""
NOTICED_S = 0.7
"""Half a second of a speed that is no error of measurement, and ticks."""


@pytest.mark.slow
async def test_each_pass_of_a_deaf_robot_is_a_p1_and_never_called_half_speed() -> None:
    stage, waits, accused = Stage("nlos"), list[float](), False
    stage.happen(DEAF, Faults(deaf=True))
    told_at: float | None = None
    profile = stage.desk.world.robot(DEAF).profile
    for _ in range(STEPS):
        await stage.step()
        limit = stage.desk.evaluator.speed_limits[DEAF]
        situation = stage.robot(DEAF)["situation"]
        is_fast = stage.speed(DEAF) > slow_below(profile)
        assert not (is_fast and situation["state"] == "half")
        if limit.reason != "person" or not is_fast:
            told_at, accused = None, False
            continue
        told_at = told_at or stage.now.mono
        if situation["kind"] == "disobeys" and not accused:
            waits.append(stage.now.mono - told_at)
            accused = True

    assert len(waits) == 2
    assert max(waits) <= allowed_s(profile) + NOTICED_S
