"""How much of what happens in an ordinary hour asks for people: next to nothing.

The emulator's demonstration on the virtual clock: workers cross, robots slow for them
and drive on.  What is wrong all the same is told, each fault under its own name.
"""

import os
from functools import partial

import pytest

from tests.faulty_world import Faults
from tests.stage import Stage

QUIET_S = 60 * int(os.environ.get("IVEG_QUIET_MINUTES", "1"))
"""`IVEG_QUIET_MINUTES=20` looks as long as the promise is."""
FAULTS = {
    "alert.person_not_slowing": ("AGII", Faults(deaf=True)),
    "alert.clock_offset": ("AGII", Faults(clock_offset_s=30.0)),
    "alert.moving_robot_lost": ("AGI", Faults(mute=True)),
}


@pytest.mark.slow
async def test_13_10_a_quiet_run_raises_nothing_and_each_fault_its_alert() -> None:
    stage = Stage("demo")
    for _ in range(20 * QUIET_S):
        await stage.step()
    quiet = stage.log(None, "log.alert.raised")
    slowed = stage.log(None, "log.speed_down.person")

    for key, (robot_id, faults) in FAULTS.items():
        await stage.until(partial(drives, stage, robot_id), "it drives")
        stage.happen(robot_id, faults)
        await stage.until(partial(tells, stage, key), key, 240.0)

    assert quiet == []
    assert slowed != []


def drives(stage: Stage, robot_id: str) -> bool:
    """Whether it moves."""
    return stage.speed(robot_id) > 0.2


def tells(stage: Stage, key: str) -> bool:
    """Whether people are told so now."""
    return key in {alert["key"] for alert in stage.alerts()}
