"""What is counted depends on the seed alone: not on the machine, nor on its clock."""

from typing import Any

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.lab.experiment.outcome import counted_of
from iveg.lab.experiment.plan import PlannedRun
from iveg.lab.experiment.scoring import score
from iveg.lab.experiment.stage import VirtualRun

RULE = DetectionRule()


async def counted(
    seed: int,
    family: str = "together",
    profile: str = "field",
    seconds: float = 5.0,
) -> Any:
    rehearsal = VirtualRun(PlannedRun(family, 1, 6.0, seed, profile=profile), RULE)
    return counted_of(await rehearsal.play(seconds))


async def test_the_same_seed_gives_the_same_counts_to_the_last_digit() -> None:
    assert await counted(7) == await counted(7) != await counted(8)


async def test_a_perfect_detector_scores_one_although_poses_are_wrong() -> None:
    result = await counted(2027, "together", "perfect", 60.0)

    total = score(result["classes"].values())
    assert (total.fp, total.fn) == (0, 0)
    assert total.ap == pytest.approx(1.0)
    assert total.tp > 900
