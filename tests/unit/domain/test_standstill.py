"""A rest that is measured on the robot's clock, and what contradicts it."""

from collections.abc import Callable
from math import inf

import pytest

from iveg.domain.motion import UNMOVED
from iveg.domain.observations import Instant, Origin
from iveg.domain.stop.standstill import Standstill
from tests.builders import START, at, odometry

HOUR_S = 3600.0
SECONDS = [0.2 * number for number in range(6)]
CONTRADICTED = ["agrees", "agrees", "contradicts"]


def said(
    mono: float, *, boot: str = "a", clock_off: float = 0.0, with_mono: bool = True
) -> Origin:
    """A message measured at this moment of the robot's (s)."""
    stamp_s = START.wall + mono + clock_off
    seq = 1 + round(1000 * mono)
    return Origin(boot, seq, "t", stamp_s, mono if with_mono else None)


def stood(late: float = 0.0) -> Standstill:
    """At rest from 10.0 to 11.0 on the robot's clock; reports come ``late``."""
    rest = Standstill()
    found = [rest.rested(at(10.0 + s + late), said(10.0 + s)) for s in SECONDS]
    assert found == [False] * 5 + [True]
    return rest


def take(
    rest: Standstill,
    moment: Instant,
    origin: Origin,
    age_s: float = inf,
    *,
    moves: bool,
) -> str:
    """What odometry comes to whose wheels turn, or rest; its pose stays."""
    sample = odometry(linear=0.3 * moves, origin=origin)
    return rest.odometry(sample, UNMOVED, moment, age_s)


def moving(rest: Standstill, *moments: float, late: float = 0.0) -> list[str]:
    """What moving samples of odometry come to, measured at these moments."""
    return [take(rest, at(mono + late), said(mono), moves=True) for mono in moments]


# --- the rest ---------------------------------------------------------------------


FAST, SLOW = ([rate * n for n in range(12)] for rate in (0.45, 0.4))


@pytest.mark.parametrize(
    ("measured", "every_s", "age_s", "rests"),
    [
        ([10.0 + s for s in SECONDS], 0.2, 0.0, 6),
        ([10.0 + s for s in SECONDS], 0.0, 9.0, None),
        ([10.0, 10.2, 10.4, 11.0, 11.2, 11.4, 11.6, 11.8, 12.0], 0.2, inf, 9),
        ([5.0] * 3, 0.5, inf, None),
        (FAST, 0.1, 0.15, 10),
        (FAST, 0.1, 9.0, 6),
        (FAST, 0.1, inf, 11),
        (SLOW, 2.0, 0.2, None),
    ],
    ids=[
        *("honest", "all at once", "a gap in what was measured", "moments do not rise"),
        *("fast", "fast and late at first", "fast, of unknown age", "slow, over gaps"),
    ],
)
def test_a_rest_is_long_by_the_robots_clock_and_by_ours(
    measured: list[float], every_s: float, age_s: float, rests: int | None
) -> None:
    rest = Standstill()

    found = [
        rest.rested(at(30.0 + every_s * n), Origin("a", n, mono=mono), age_s)
        for n, mono in enumerate(measured, 1)
    ]

    assert (found.index(True) + 1 if any(found) else None) == rests


def test_a_clock_that_is_too_fast_does_not_outrun_wheels_that_moved() -> None:
    rest = stood()
    moving(rest, 11.05)

    found = [rest.rested(at(11.2 + s), said(11.2 + 2.4 * s)) for s in SECONDS[:3]]

    assert found == [False, False, True]


def test_a_clock_that_is_set_back_does_not_hide_a_rest_for_long() -> None:
    rest = stood()

    found = [
        rest.rested(at(11.2 + s), said(11.2 + s, clock_off=-HOUR_S))
        for s in [*SECONDS, 1.2]
    ]

    assert found == [False] * 6 + [True]


# --- motion -----------------------------------------------------------------------


@pytest.mark.parametrize("late", [0.0, 2.0, 60.0])
def test_motion_from_before_the_rest_changes_nothing_however_late(late: float) -> None:
    rest = stood()

    found = moving(rest, *(9.0 + 0.1 * n for n in range(11)), late=late)

    assert found == ["before"] * 11
    assert rest.rested(at(11.2), said(11.2))


@pytest.mark.parametrize(
    ("first", "late"),
    [(11.1, 0.0), (10.5, 5.0), (11.5, 2.0)],
    ids=["after the rest", "during it", "in a gap of it"],
)
def test_motion_during_or_after_the_rest_contradicts_with_three_samples(
    first: float, late: float
) -> None:
    rest = stood()
    if first == 11.5:
        rest.rested(at(12.0), said(12.0))

    found = moving(rest, first, first + 0.1, first + 0.2, late=late)

    assert found == CONTRADICTED


@pytest.mark.parametrize(
    "origin_of",
    [
        lambda mono: said(mono, clock_off=HOUR_S),
        lambda mono: said(mono, clock_off=-HOUR_S),
        lambda _: said(9.0, with_mono=False),
        lambda _: said(9.0, boot="b"),
        lambda _: Origin("a", None),
        lambda _: Origin(),
    ],
)
def test_no_wall_clock_and_no_motion_without_a_moment_protects_a_standstill(
    origin_of: Callable[[float], Origin],
) -> None:
    rest = stood()

    found = [
        take(rest, at(mono), origin_of(mono), moves=True) for mono in (11.1, 11.2, 11.3)
    ]

    assert found == CONTRADICTED


def test_a_topic_whose_moments_fell_once_is_compared_no_more() -> None:
    rest = stood()
    again = [Origin("a", 20_000 + n, mono=1.0 + 0.1 * n) for n in range(4)]
    take(rest, at(11.0), Origin("a", 19_999, mono=11.0), moves=False)

    found = [
        take(rest, at(11.1 + 0.1 * n), one, moves=True) for n, one in enumerate(again)
    ]

    assert found == [*CONTRADICTED, "contradicts"]


def test_moments_that_lie_are_found_out_by_what_the_robot_had_heard() -> None:
    rest = stood()

    found = [
        take(rest, at(12.0 + s), said(1.0 + s), 0.2, moves=True)
        for s in (0.0, 0.1, 0.2)
    ]

    assert found == CONTRADICTED


def test_one_sample_that_moved_delays_a_standstill_by_half_a_second() -> None:
    rest = Standstill()
    for s in SECONDS[:5]:
        rest.rested(at(10.0 + s), said(10.0 + s))
    moving(rest, 10.9)

    found = [rest.rested(at(10.0 + s), said(10.0 + s)) for s in (1.0, 1.2, 1.4)]

    assert found == [False, False, True]
