"""What is counted depends on the seed alone: not on the machine, nor on its clock."""

from typing import Any

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.lab.experiment.outcome import half_of
from iveg.lab.experiment.plan import ROBOTS, PlannedRun
from iveg.lab.experiment.scoring import Tally, score
from iveg.lab.experiment.virtual_run import VirtualRun
from iveg.robot.costmap import FleetCostmap
from iveg.robot.neighbours import Neighbours

RULE = DetectionRule()


async def counted(
    seed: int,
    family: str = "together",
    profile: str = "field",
    seconds: float = 5.0,
) -> Any:
    rehearsal = VirtualRun(PlannedRun(family, 1, 6.0, seed, profile=profile), RULE)
    return half_of(await rehearsal.play(seconds))


async def test_the_same_seed_gives_the_same_counts_to_the_last_digit() -> None:
    assert await counted(7) == await counted(7) != await counted(8)


async def test_every_picture_of_every_robot_is_counted() -> None:
    told = await counted(7)

    assert told["pictures"] == len(ROBOTS) * 10 * 5
    assert told["completed"] is True
    farmer = told["classes"]["farmer"]
    assert len(farmer["found"]) + farmer["missed"] > 20


async def test_a_perfect_detector_scores_one_although_poses_are_wrong() -> None:
    told = await counted(2027, "together", "perfect", 60.0)

    of = score(Tally(**one) for one in told["classes"].values())
    off = [place for one in told["classes"].values() for place in one["off_map"]]
    own = [place for one in told["classes"].values() for place in one["off_robot"]]
    assert (of.fp, of.fn) == (0, 0)
    assert of.ap == pytest.approx(1.0)
    assert of.tp > 900
    assert max(off) > 0.2 > 0.002 > max(own)


async def test_a_person_whom_only_agi_sees_stands_in_agiis_costmap() -> None:
    told = await counted(7, "nlos", "perfect", 9.0)

    assert told["injection"]["ahead"] == told["injection"]["people"] == 1
    assert told["injection"]["injected"] >= 3
    assert told["slowdowns"]["out_of_sight"] >= 1


async def test_a_robot_that_hears_nothing_of_others_has_nobody_injected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is the robot's own costmap that counts: iVeg still knows of the person."""
    monkeypatch.setattr(Neighbours, "present", lambda *_: [])
    monkeypatch.setattr(FleetCostmap, "hear", lambda *_: None)

    told = await counted(7, "nlos", "perfect", 9.0)

    assert told["injection"]["asked"] >= 3
    assert told["injection"]["injected"] == 0
