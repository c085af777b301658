"""Intervals of shares, and the verdict on two of them."""

import pytest

from iveg.lab.experiment.paper_tables import disagreements
from iveg.lab.experiment.statistics import (
    Interval,
    difference,
    thinned,
    verdict,
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


def test_of_nothing_nothing_is_known() -> None:
    assert wilson(0, 0) is None


def test_counts_that_prove_little_have_the_interval_of_what_they_prove() -> None:
    many, few = wilson(900, 1000), thinned(900, 1000, 10)

    assert few == wilson(9, 10)
    assert many is not None
    assert few is not None
    assert few.share == many.share
    assert few.low < many.low
    assert thinned(0, 0, 0) is None


def test_newcombes_interval_of_a_difference_is_the_one_in_the_books() -> None:
    after, before = wilson(56, 70), wilson(48, 80)
    assert after is not None
    assert before is not None

    found = difference(before, after)

    assert found.share == pytest.approx(0.2)
    assert (found.low, found.high) == pytest.approx((0.0524, 0.3339), abs=2e-4)
    assert verdict(found) == "better"


@pytest.mark.parametrize(
    ("low", "high", "told"),
    [(0.01, 0.2, "better"), (-0.2, -0.01, "worse"), (-0.1, 0.1, "cannot tell")],
)
def test_a_difference_is_told_only_where_the_interval_leaves_no_doubt(
    low: float, high: float, told: str
) -> None:
    assert verdict(Interval((low + high) / 2, low, high)) == told


def test_what_does_not_follow_in_the_papers_tables_is_found() -> None:
    found = {(one.place, one.row, one.what): one.follows for one in disagreements()}

    assert found == {
        ("simulation", "AGI", "precision %"): 90.0,
        ("simulation", "AGI", "recall %"): 90.0,
        ("simulation", "AGII", "recall %"): 90.32,
        ("simulation", "total", "FP"): 9,
        ("simulation", "total", "precision %"): 92.63,
        ("simulation", "total", "recall %"): 93.62,
    }
