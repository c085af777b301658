"""Detections are scored against the truth, and a rate has its interval."""

import pytest

from iveg.lab.experiment.scoring import (
    Picture,
    Score,
    SeenObject,
    score,
    tally,
    thinned,
    wilson,
)


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"),
    # Newcombe 1998, table I, method 3; and the paper's recall of farmers in the field.
    [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
        (36, 39, 0.7968, 0.9735),
    ],
)
def test_wilsons_interval_is_the_one_in_the_books(
    hits: int, of: int, low: float, high: float
) -> None:
    found = wilson(hits, of)

    assert found is not None
    assert (found.low, found.high) == pytest.approx((low, high), abs=2e-4)


def test_counts_that_prove_little_have_the_interval_of_what_they_prove() -> None:
    many, few = wilson(900, 1000), thinned(900, 1000, 10)

    assert few == wilson(9, 10)
    assert many is not None
    assert few is not None
    assert few.share == many.share
    assert few.low < many.low
    assert thinned(0, 0, 0) is None


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


def test_counts_are_worth_as_many_looks_of_two_seconds_as_they_are_of() -> None:
    found = scored(pictures(8, person()), pictures(8, person(), person(9.0)))

    assert (found.tp, found.fp) == (80, 80)
    assert found.recall == wilson(4, 4)
    assert found.precision == wilson(4, 8)


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
