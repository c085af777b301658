"""Detections are scored against the truth."""

import pytest

from iveg.lab.experiment.scoring import (
    Picture,
    Score,
    SeenObject,
    score,
    tally,
)

HZ = 10


def person(x: float = 5.0, confidence: float = 0.9, key: str = "p") -> SeenObject:
    return SeenObject(key, "farmer", x, 0.0, confidence)


def pictures(seconds: int, *seen: SeenObject) -> list[Picture]:
    """Ten a second, all with the same in them."""
    return [Picture("AGI", 1000.0 + n / HZ, tuple(seen)) for n in range(HZ * seconds)]


def scored(truth: list[Picture], told: list[Picture]) -> Score:
    return score([tally(zip(truth, told, strict=True))["farmer"]])


def test_one_wrong_picture_is_one_miss_and_one_ghost() -> None:
    told = pictures(2, person())
    told[3] = Picture("AGI", told[3].at, (person(9.0),))

    found = scored(pictures(2, person()), told)

    assert (found.tp, found.fp, found.fn) == (19, 1, 1)
    assert found.precision == found.recall == 0.95


def test_each_target_takes_its_own_detection_the_surest_first() -> None:
    two = (person(5.0, key="a"), person(5.6, key="b"))
    told = (person(5.02, 0.7), person(5.58, 0.95), person(5.1, 0.6))

    found = scored(pictures(2, *two), pictures(2, *told))

    assert (found.tp, found.fp, found.fn) == (40, 20, 0)


def test_average_precision_falls_with_ghosts_that_are_surer_than_what_is_there() -> (
    None
):
    truth = pictures(4, person())
    sure = pictures(2, person(9.0, 0.99)) + pictures(4, person(5.0, 0.5))[2 * HZ :]
    unsure = pictures(2, person(9.0, 0.1)) + pictures(4, person(5.0, 0.5))[2 * HZ :]

    low, high = scored(truth, sure), scored(truth, unsure)

    assert (low.tp, low.fp, low.fn) == (high.tp, high.fp, high.fn) == (20, 20, 20)
    assert low.ap == pytest.approx(0.25)
    assert high.ap == pytest.approx(0.5)
