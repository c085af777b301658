import itertools
import math
from dataclasses import dataclass, replace

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import Detection
from iveg.lab.emulator.camera import (
    DETECTORS,
    FIELD_COUNTS,
    DetectorModel,
    EmulatedDetector,
    Target,
    person_target,
)
from iveg.lab.emulator.greenhouse import Disc, Scenery
from tests.builders import AGI

BOUNDS = Rectangle(-20.0, -20.0, 20.0, 20.0)
OPEN = Scenery.from_greenhouse(Greenhouse("yard", BOUNDS))
HERE = Pose2D(0.0, 0.0, 0.0)
EVERY_S = 2.5
"""Longer than any encounter, so that each look is an encounter of its own."""


def looks(
    target: Target,
    count: int = 1,
    *,
    model: DetectorModel = DETECTORS["perfect"],
    scenery: Scenery = OPEN,
    pose: Pose2D = HERE,
    every_s: float = EVERY_S,
    seed: int = 1,
) -> list[tuple[Detection, ...]]:
    detector = EmulatedDetector(AGI, model, np.random.default_rng(seed))
    return [detector.detect(n * every_s, pose, [target], scenery) for n in range(count)]


def person(x: float, y: float) -> Target:
    return person_target(0, Disc(x, y, 0.25))


def test_a_person_in_view_becomes_a_box_in_base_link() -> None:
    pose = Pose2D(2.0, 3.0, math.pi / 2)

    ((found,),) = looks(person(2.0, 8.0), pose=pose)

    assert found.class_id == "farmer"
    assert found.frame_id == "base_link"
    assert found.box.centre == pytest.approx((5.0, 0.0, 0.875))
    assert found.box.zmin == 0.0


@dataclass(frozen=True, slots=True)
class Tally:
    """What one encounter after the other came to."""

    encounters: int
    true_positives: int
    false_positives: int


def tally(class_id: str, encounters: int) -> Tally:
    """Let a detector of the field meet a target of a class, again and again."""
    target = replace(person(4.0, 0.0), class_id=class_id)
    frames = looks(target, encounters, model=DETECTORS["field"])
    boxes = [box for frame in frames for box in frame]
    true = sum(math.dist(box.box.centre[:2], (4.0, 0.0)) < 0.4 for box in boxes)
    assert {box.class_id for box in boxes} == {class_id}
    return Tally(encounters, true, len(boxes) - true)


@pytest.mark.parametrize(
    ("class_id", "true_positives", "false_positives", "false_negatives"),
    [("farmer", 36, 6, 3), ("AGI", 34, 8, 5), ("AGII", 28, 12, 8)],
)
def test_rates_lie_within_the_binomial_interval_of_the_papers_field_counts(
    class_id: str, true_positives: int, false_positives: int, false_negatives: int
) -> None:
    told = true_positives + false_negatives
    found = tally(class_id, 4_000)

    recall = found.true_positives / found.encounters
    ghosts = found.false_positives / found.encounters
    precision = found.true_positives / (found.true_positives + found.false_positives)

    named = true_positives + false_positives
    assert is_within(recall, true_positives, told)
    assert is_within(ghosts, false_positives, told)
    assert is_within(precision, true_positives, named)


def is_within(share: float, hits: int, trials: int) -> bool:
    """Whether a share is in the 95 % interval of the paper's counts."""
    expected = hits / trials
    deviation = math.sqrt(expected * (1.0 - expected) / trials)
    return abs(share - expected) < 1.96 * deviation


@pytest.mark.parametrize(("profile", "mean"), [("field", 0.72), ("simulation", 0.85)])
def test_the_mean_confidence_is_the_papers(profile: str, mean: float) -> None:
    model = replace(DETECTORS[profile], counts={})
    frames = looks(person(4.0, 0.0), 1_000, model=model)

    assert np.mean([f.probability for (f,) in frames]) == pytest.approx(mean, abs=0.01)


def test_a_miss_lasts_as_long_as_an_encounter_and_no_longer() -> None:
    always = DetectorModel(0.85, counts={"farmer": replace(FIELD_COUNTS["AGII"])})
    seen = [
        any(abs(b.box.centre[1]) < 0.4 and b.class_id == "farmer" for b in frame)
        for frame in looks(person(4.0, 0.0), 6_000, model=always, every_s=1 / 30)
    ]
    runs = [len(list(run)) / 30 for run in _runs(seen) if not run[0]]

    assert min(runs) >= 0.45
    assert 1.0 < np.mean(runs) < 2.5


def _runs(seen: list[bool]) -> list[list[bool]]:
    edges = [0, *(np.flatnonzero(np.diff(seen)) + 1).tolist(), len(seen)]
    return [seen[a:b] for a, b in itertools.pairwise(edges)]
