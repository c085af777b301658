"""The day's account of margins: time that was negative, known and unknown."""

from dataclasses import replace

import pytest

from iveg.domain.exposure import PERIOD_S, Exposures
from iveg.domain.margins import SafetyMargin
from iveg.domain.observations import Instant
from tests.builders import at

# Needs 1.0 + 0.5 + 0.1 + 0.4 = 2.0 m.
WIDE = SafetyMargin("AGI", "P1", 5.0, 1.0, 0.5, 0.1, age_s=0.1, braking=1.0)
NEAR = replace(WIDE, gap_m=1.5)
LOST = replace(NEAR, known=False)
LONG_AGO = replace(NEAR, age_s=1.1)


def watch(days: Exposures, *looks: list[SafetyMargin], seen: bool = True) -> None:
    """One look each half a second."""
    begin = 0 if days.today is None else days.today.evaluations
    for number, margins in enumerate(looks):
        days.update(margins, at(PERIOD_S * (begin + number)), seen=seen)


def test_each_look_stands_for_the_time_since_the_one_before() -> None:
    days = Exposures()

    watch(days, [], [WIDE], [NEAR, WIDE], [], [])

    today = days.today
    assert today is not None
    assert (today.evaluations, today.known_s, today.negative_s) == (5, 2.0, 0.5)
    assert today.share == pytest.approx(0.25)


def test_the_worst_margin_keeps_who_and_when() -> None:
    days = Exposures()

    watch(days, [WIDE], [NEAR], [WIDE])

    today = days.today
    assert today is not None
    assert today.worst is not None
    assert (today.worst.margin, today.worst.at) == (NEAR, at(PERIOD_S))
    assert today.worst.margin.margin_m == pytest.approx(-0.5)


def test_what_nobody_knows_is_neither_margin_nor_danger() -> None:
    days = Exposures()

    watch(days, [], [LOST], [WIDE, LONG_AGO])
    watch(days, [], seen=False)

    today = days.today
    assert today is not None
    assert (today.known_s, today.unknown_s) == (0.0, 1.5)
    assert today.share is None


def test_a_margin_that_is_known_to_be_negative_needs_no_other() -> None:
    days = Exposures()

    watch(days, [], [NEAR, LOST])

    assert days.today is not None
    assert (days.today.negative_s, days.today.unknown_s) == (0.5, 0.0)


def test_a_look_after_a_long_silence_does_not_stand_for_all_of_it() -> None:
    days = Exposures()
    days.update([NEAR], at(0), seen=True)

    days.update([NEAR], at(3600), seen=True)

    assert days.today is not None
    assert days.today.negative_s == pytest.approx(2 * PERIOD_S)


def test_at_midnight_a_new_account_begins() -> None:
    days, midnight = Exposures(), 86_400.0 * 20_000
    before, after = Instant(10.0, midnight - 0.5), Instant(10.5, midnight)
    days.update([NEAR], before, seen=True)

    days.update([WIDE], after, seen=True)

    today = days.today
    assert today is not None
    assert (today.since, today.evaluations, today.negative_s) == (after, 1, 0.0)
    assert today.worst is not None
    assert today.worst.margin == WIDE


def test_a_look_is_due_twice_a_second() -> None:
    days = Exposures()
    assert days.due(at(0))

    watch(days, [])

    assert not days.due(at(0.45))
    assert days.due(at(0.5))
