"""What is counted depends on the seed alone: not on the machine, nor on its clock."""

from typing import Any

from iveg.domain.detection_rule import DetectionRule
from iveg.lab.experiment.outcome import counted_of
from iveg.lab.experiment.plan import ROBOTS, PlannedRun
from iveg.lab.experiment.virtual_run import VirtualRun

RULE = DetectionRule()


async def counted(
    seed: int,
    family: str = "together",
    profile: str = "field",
    seconds: float = 5.0,
) -> Any:
    rehearsal = VirtualRun(PlannedRun(family, 1, 6.0, seed), profile, RULE, "AGII")
    return counted_of(await rehearsal.play(seconds), "AGII")


async def test_the_same_seed_gives_the_same_counts_to_the_last_digit() -> None:
    assert await counted(7) == await counted(7) != await counted(8)


async def test_every_picture_of_every_robot_is_counted() -> None:
    told = await counted(7)

    assert told["pictures"] == len(ROBOTS) * 10 * 5
    assert told["completed"] is True
    farmer = told["classes"]["farmer"]
    assert len(farmer["found"]) + farmer["missed"] > 20


async def test_a_perfect_detector_makes_no_mistake_on_its_way_through_iveg() -> None:
    told = await counted(7, profile="perfect")

    assert {name: one["missed"] for name, one in told["classes"].items()} == {
        "AGI": 0,
        "AGII": 0,
        "farmer": 0,
    }
    assert not [one for one in told["classes"].values() if one["ghosts"]]


async def test_a_person_whom_only_agi_sees_stands_in_agiis_costmap() -> None:
    told = await counted(7, "nlos", "perfect", 9.0)

    assert told["injection"]["ahead"] == told["injection"]["people"] == 1
    assert told["injection"]["injected"] >= 3
    assert told["slowdowns"]["out_of_sight"] >= 1
