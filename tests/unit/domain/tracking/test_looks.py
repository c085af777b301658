"""Looks at one person add up to a probability, and their absence counts against it."""

from collections.abc import Sequence

import pytest

from iveg.domain.tracking.looks import (
    LOOK_S,
    MOST_SUSPECTS,
    FaintPerson,
    Looks,
    Suspicions,
)
from tests.builders import at


def seen(confidence: float = 0.72, x: float = 5.0) -> FaintPerson:
    return FaintPerson(x, 0.0, confidence)


class Robots:
    """Suspicions of robots that need 0.80, and what each look finds."""

    def __init__(self) -> None:
        self.suspicions = Suspicions()

    def look(
        self, seen: Sequence[FaintPerson], moment: float, robot: str = "AGI"
    ) -> list[Looks]:
        found = self.suspicions.look(robot, seen, at(moment), 0.8)
        return [one for one in found if one is not None]


def test_two_looks_are_surer_than_either() -> None:
    robots = Robots()
    robots.look([seen(0.68)], 0.0)
    (looks,) = robots.look([seen(0.75)], LOOK_S)

    assert (looks.count, looks.least, looks.most, looks.over_s) == (2, 0.68, 0.75, 0.3)
    odds = 0.68 / 0.32 * 0.75 / 0.25
    assert looks.probability == pytest.approx(odds / (1.0 + odds)), "by Bayes' rule"


def test_pictures_of_one_moment_are_one_look_by_the_surest_of_them() -> None:
    robots = Robots()
    for moment, confidence in ((0.0, 0.6), (0.1, 0.72), (0.2, 0.55)):
        (looks,) = robots.look([seen(confidence)], moment)

    assert looks.count == 1
    assert looks.probability == pytest.approx(0.72)


def test_time_without_a_look_counts_against_it() -> None:
    told = []
    for pictures_without in (0, 2):
        robots = Robots()
        robots.look([seen(0.78)], 0.0)
        for number in range(pictures_without):
            robots.look([], 0.35 + 0.35 * number)
        (looks,) = robots.look([seen(0.6)], 0.95)
        told.append(looks.probability)

    assert told[1] < told[0]


def test_who_walks_on_is_the_same_and_who_stands_elsewhere_another() -> None:
    robots = Robots()
    robots.look([seen(x=5.0)], 0.0)
    (other_robots,) = robots.look([seen()], 0.1, "AGII")
    walked, other = robots.look([seen(x=5.5), seen(x=9.0)], LOOK_S)
    robots.look([], LOOK_S + 1.01)
    (later,) = robots.look([seen(x=5.5)], LOOK_S + 1.1)

    assert [one.count for one in (walked, other, other_robots, later)] == [2, 1, 1, 1]


@pytest.mark.parametrize(
    "first", [(0.85,), (0.72, 0.72)], ids=["one box", "looks together"]
)
def test_who_is_confirmed_is_kept_by_weak_boxes_and_misses(
    first: tuple[float, ...],
) -> None:
    robots = Robots()
    for number, confidence in enumerate(first):
        robots.look([seen(confidence)], number * LOOK_S)
    for number in range(10):
        robots.look([], 0.5 + 0.9 * number)
        (looks,) = robots.look([seen(0.26)], 0.9 + 0.9 * number)

        assert looks.confirmed
        assert looks.count == len(first)


@pytest.mark.parametrize(
    ("weak", "moment", "x"),
    [(0.26, 1.9, 5.0), (0.26, 1.2, 8.0), (0.55, 2.5, 5.0)],
    ids=["after a second", "elsewhere", "as a new one"],
)
def test_a_weak_box_keeps_nobody_else(weak: float, moment: float, x: float) -> None:
    robots = Robots()
    robots.look([seen(0.85)], 0.8)

    assert not any(one.confirmed for one in robots.look([seen(weak, x)], moment))


def test_a_storm_keeps_the_newest() -> None:
    robots = Robots()
    crowd = [seen(x=3.0 * number) for number in range(MOST_SUSPECTS)]
    robots.look(crowd, 0.0)
    robots.look([seen(x=-50.0)], 0.1)
    (looks,) = robots.look([seen(x=-50.0)], 0.1 + LOOK_S)

    assert looks.count == 2
