"""Detections against the truth, picture by picture, worth as much as they prove."""

import random

import pytest

from iveg.lab.experiment.scoring import (
    Picture,
    Score,
    SeenObject,
    overlap,
    paired,
    score,
    tally,
)

HZ = 10


def person(x: float = 5.0, confidence: float = 0.9, key: str = "p") -> SeenObject:
    return SeenObject(key, "farmer", x, 0.0, confidence)


def pictures(seconds: int, *seen: SeenObject, robot_id: str = "AGI") -> list[Picture]:
    """Ten a second, all with the same in them."""
    return [
        Picture(robot_id, 1000.0 + n / HZ, tuple(seen)) for n in range(HZ * seconds)
    ]


def scored(truth: list[Picture], told: list[Picture]) -> Score:
    return score([tally(paired(truth, told))["farmer"]])


def test_a_person_who_is_told_in_each_picture_is_found_in_each() -> None:
    found = scored(pictures(4, person()), pictures(4, person(5.05)))

    assert (found.tp, found.fp, found.fn) == (40, 0, 0)
    assert found.ap == pytest.approx(1.0)


def test_a_person_who_is_never_told_is_missed_in_each_picture() -> None:
    found = scored(pictures(3, person()), pictures(3))

    assert (found.tp, found.fp, found.fn) == (0, 0, 30)


def test_what_is_not_there_is_a_ghost_and_hides_no_miss() -> None:
    found = scored(pictures(3, person(5.0)), pictures(3, person(8.0)))

    assert (found.tp, found.fp, found.fn) == (0, 30, 30)


def test_one_wrong_picture_is_one_miss_and_one_ghost() -> None:
    told = pictures(2, person())
    told[3] = Picture("AGI", told[3].at, (person(9.0),))

    found = scored(pictures(2, person()), told)

    assert (found.tp, found.fp, found.fn) == (19, 1, 1)


def test_counts_are_worth_as_many_looks_of_two_seconds_as_they_are_of() -> None:
    found = scored(pictures(8, person()), pictures(8, person(), person(9.0)))

    assert (found.tp, found.fp) == (80, 80)
    assert (found.looks, found.claims) == (4, 8)


def test_pictures_that_nobody_wrote_down_are_not_compared() -> None:
    later = [Picture("AGI", one.at + 60.0, one.seen) for one in pictures(2, person())]

    assert list(paired(pictures(2, person()), later)) == []


def test_pictures_of_another_robot_prove_nothing() -> None:
    other = pictures(2, person(), robot_id="AGII")

    assert list(paired(pictures(2, person()), other)) == []


def test_each_target_takes_its_own_detection_the_surest_first() -> None:
    two = (person(5.0, key="a"), person(5.6, key="b"))
    told = (person(5.02, 0.7), person(5.58, 0.95), person(5.1, 0.6))

    found = scored(pictures(2, *two), pictures(2, *told))

    assert (found.tp, found.fp, found.fn) == (40, 20, 0)


@pytest.mark.parametrize(
    ("apart", "share"), [(0.0, 1.0), (0.25, 1 / 3), (0.5, 0.0), (9.0, 0.0)]
)
def test_overlap_is_intersection_over_union(apart: float, share: float) -> None:
    assert overlap(person(5.0), person(5.0 + apart)) == pytest.approx(share)


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


def test_counts_are_the_same_whatever_order_pictures_come_in() -> None:
    truth, told = pictures(5, person()), pictures(5, person(5.1))
    mixed = random.Random(2).sample(told, len(told))  # noqa: S311 - an order

    assert scored(truth, mixed) == scored(truth, told)


def test_runs_add_up_to_one_score() -> None:
    one = tally(paired(pictures(3, person()), pictures(3, person())))
    other = tally(paired(pictures(2, person()), pictures(2)))

    both = score([one["farmer"], other["farmer"]])

    assert (both.tp, both.fn) == (30, 20)
