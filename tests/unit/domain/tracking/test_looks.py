"""Looks at one person add up to a probability, and their absence counts against it."""

import math

import pytest

from iveg.domain.tracking.looks import (
    LOOK_S,
    MOST_SUSPECTS,
    FaintPerson,
    Suspicions,
)
from tests.builders import at


def seen(confidence: float = 0.72, x: float = 5.0) -> FaintPerson:
    return FaintPerson(x, 0.0, confidence)


def probability(*confidences: float) -> float:
    """What so many independent looks come to, by Bayes' rule with an even prior."""
    odds = math.prod(one / (1.0 - one) for one in confidences)
    return odds / (1.0 + odds)


def test_one_look_is_as_sure_as_its_box() -> None:
    (looks,) = Suspicions().look("AGI", [seen(0.72)], at(0.0))

    assert (looks.count, looks.least, looks.most, looks.over_s) == (1, 0.72, 0.72, 0.0)
    assert looks.probability == pytest.approx(0.72)
    assert not looks.reach(0.7)


def test_two_looks_are_surer_than_either() -> None:
    suspicions = Suspicions()
    suspicions.look("AGI", [seen(0.68)], at(0.0))
    (looks,) = suspicions.look("AGI", [seen(0.75)], at(LOOK_S))

    assert (looks.count, looks.least, looks.most, looks.over_s) == (2, 0.68, 0.75, 0.3)
    assert looks.probability == pytest.approx(probability(0.68, 0.75))


def test_pictures_of_one_moment_are_one_look_by_the_surest_of_them() -> None:
    suspicions = Suspicions()
    for moment, confidence in ((0.0, 0.6), (0.1, 0.72), (0.2, 0.55)):
        (looks,) = suspicions.look("AGI", [seen(confidence)], at(moment))

    assert looks.count == 1
    assert looks.probability == pytest.approx(0.72)


def test_no_number_of_looks_makes_certain() -> None:
    suspicions = Suspicions()
    for number in range(100):
        (looks,) = suspicions.look("AGI", [seen(0.79)], at(number * LOOK_S))

    assert looks.probability == pytest.approx(0.982, abs=1e-4)


def test_time_without_a_look_counts_against_it() -> None:
    told = []
    for pictures_without in (0, 2):
        suspicions = Suspicions()
        suspicions.look("AGI", [seen(0.78)], at(0.0))
        for number in range(pictures_without):
            suspicions.look("AGI", [], at(0.35 + 0.35 * number))
        (looks,) = suspicions.look("AGI", [seen(0.6)], at(0.95))
        told.append(looks.probability)

    assert told[1] < told[0]


def test_a_second_without_a_look_ends_a_suspicion() -> None:
    suspicions = Suspicions()
    suspicions.look("AGI", [seen(0.78)], at(0.0))
    suspicions.look("AGI", [], at(1.01))
    (looks,) = suspicions.look("AGI", [seen(0.6)], at(1.1))

    assert looks.count == 1


def test_who_walks_on_is_the_same_and_who_stands_elsewhere_another() -> None:
    suspicions = Suspicions()
    suspicions.look("AGI", [seen(x=5.0)], at(0.0))
    walked, other = suspicions.look("AGI", [seen(x=5.5), seen(x=9.0)], at(LOOK_S))

    assert (walked.count, other.count) == (2, 1)


def test_two_side_by_side_are_two() -> None:
    suspicions = Suspicions()
    for number in range(3):
        pair = suspicions.look("AGI", [seen(x=5.0), seen(x=5.6)], at(number * LOOK_S))

    assert [one.count for one in pair] == [3, 3]


def test_each_robot_has_its_own_suspicions() -> None:
    suspicions = Suspicions()
    suspicions.look("AGI", [seen()], at(0.0))
    (looks,) = suspicions.look("AGII", [seen()], at(LOOK_S))

    assert looks.count == 1


def test_a_storm_keeps_the_newest() -> None:
    suspicions = Suspicions()
    crowd = [seen(x=3.0 * number) for number in range(MOST_SUSPECTS)]
    suspicions.look("AGI", crowd, at(0.0))
    suspicions.look("AGI", [seen(x=-50.0)], at(0.1))
    (looks,) = suspicions.look("AGI", [seen(x=-50.0)], at(0.1 + LOOK_S))

    assert looks.count == 2
