"""Premises of "clear": what is missing, for whom, and what of it is told."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from iveg.domain.detector import OutOfService
from iveg.domain.feedback import CLEAR
from iveg.domain.limits import LIMITS
from iveg.domain.rule.clear import ClearCondition
from tests.builders import at
from tests.unit.domain.scene import Scene

REACH_M = 8.0 + LIMITS.zone_most_m
"""Of AGI's camera, and beyond."""


def fleet(*places: float, observer: str = "AGI") -> Scene:
    """AGI at 0, R0, R1 … at these places (m), all with pictures read whole."""
    scene = Scene((observer, *(f"R{number}" for number in range(len(places)))))
    scene.drive("AGI", 0.0)
    for number, x in enumerate(places):
        scene.drive(f"R{number}", x)
        scene.look(f"R{number}")
    scene.look("AGI")
    return scene


def blinded(scene: Scene) -> Scene:
    """AGI's newest frame was refused."""
    scene.world.robot("AGI").detector.note_flaw("unreadable", at(scene.now))
    return scene


def doubted(scene: Scene) -> Scene:
    """AGI has contradicted itself for longer than a round trip."""
    doubts = scene.world.robot("AGI").doubts
    for moment in (-0.6, 0.0):
        doubts.contradicted("jumped", at(scene.now + moment))
    return scene


def factors(scene: Scene) -> list[float]:
    return [limit.speed_factor for limit in scene.judge().values()]


def test_a_healthy_fleet_lacks_nothing() -> None:
    scene = fleet(5.0, 60.0)
    assert list(scene.judge().values()) == [CLEAR] * 3
    assert set(scene.speed_limits.unmet.values()) == {()}


@pytest.mark.parametrize("spoil", [blinded, doubted])
def test_the_robot_and_all_in_its_cameras_reach_and_six_metres_drive_at_half(
    spoil: Callable[[Scene], Scene],
) -> None:
    scene = spoil(fleet(REACH_M - 0.01, -REACH_M - 0.01, 60.0))
    assert factors(scene) == [0.5, 0.5, 1.0, 1.0]


def test_who_never_sent_a_frame_is_missed_by_those_in_reach_alone() -> None:
    scene = Scene(("AGI", "R0", "R1"))
    for name, x in (("AGI", 0.0), ("R0", 5.0), ("R1", 60.0)):
        scene.drive(name, x)
    for name in ("R0", "R1"):
        scene.look(name)
    assert factors(scene) == [0.5, 0.5, 1.0]


def test_a_robot_that_was_never_seen_may_be_near_everybody() -> None:
    scene = Scene(("AGI", "R0"))
    scene.drive("R0", 60.0)
    scene.look("R0")
    assert scene.judge()["R0"].cause == "AGI"


def test_a_robot_that_was_lost_is_missed_where_it_was_last() -> None:
    scene = fleet(5.0, 60.0)
    scene.now = 700.0
    for name, x in (("R0", 5.0), ("R1", 60.0)):
        scene.drive(name, x)
        scene.look(name)
    assert factors(scene) == [0.5, 0.5, 1.0]


def test_whose_pose_is_doubted_may_be_where_it_was_before() -> None:
    scene = fleet(5.0, 60.0)
    doubts = scene.world.robot("AGI").doubts
    for moment in (0.1, 0.4, 0.7):
        scene.now = moment
        doubts.contradicted("jumped", at(moment))
        scene.drive("AGI", 500.0)
    assert factors(scene)[1:] == [0.5, 1.0]


def test_a_detector_that_the_fleet_file_denies_is_not_waited_for() -> None:
    scene = Scene(("AGI", "R0"))
    agi = scene.world.robot("AGI")
    agi.description = replace(agi.description, has_detector=False)
    scene.drive("AGI", 0.0)
    scene.drive("R0", 5.0)
    scene.look("R0")
    assert factors(scene) == [1.0, 1.0]


def test_a_detector_out_of_service_is_not_waited_for_until_the_next_boot() -> None:
    scene = fleet(5.0)
    scene.now = 2.0
    scene.world.robot("AGI").detector.out_of_service = OutOfService("maria", 1.0, None)
    scene.drive("R0", 5.0)
    scene.look("R0")
    before = factors(scene)[1]
    scene.drive("AGI", 0.0)
    assert (before, factors(scene)[1]) == (1.0, 0.5)


def test_the_own_pose_is_told_before_a_doubt_and_a_doubt_before_a_detector() -> None:
    scene = fleet(5.0)
    scene.now = 1.05
    scene.look("R0")
    blinded(doubted(scene)).judge()
    assert scene.speed_limits.unmet["R0"] == (
        ClearCondition("pose", "R0"),
        ClearCondition("doubt", "AGI"),
        ClearCondition("detector", "AGI"),
    )


def test_what_one_lacks_slows_no_other_between_live_robots_and_recordings() -> None:
    scene = blinded(fleet(3.0, observer="AGI:recording"))
    assert factors(scene) == [0.5, 1.0]

    scene = Scene(("AGI", "R0:recording"))
    scene.drive("AGI", 0.0)
    scene.drive("R0", 3.0)
    assert factors(scene) == [0.5, 1.0]
