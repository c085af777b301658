"""How soon the fleet answers, over the decisions of five minutes."""

from dataclasses import replace

import pytest

from iveg.domain.alerts import ECHO_S, acknowledgements_of
from iveg.domain.decisions import SlowdownDecision
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.rule.zones import Zone, ZoneEntry
from tests.builders import at


def asked(
    entered: float = 0.0,
    *,
    after: float | None = None,
    already_slow: bool = False,
    ahead: float | None = None,
    looked: float | None = 0.0,
) -> SlowdownDecision:
    """AGII was told at ``entered`` and answered ``after`` that long; None: never.

    The look that it rests on came ``looked`` before; None: the ring was known.  A robot
    that was ``ahead`` had said so that long before.
    """
    entry = ZoneEntry(
        f"d-{entered}",
        "AGII",
        Zone("person", "P1", "AGI", 1.0, 0.0, 2.0, 2.0),
        entered=at(entered),
        entered_m=1.43,
        speed_before=0.8,
        in_sight=False,
        distance_m=1.43,
        already_slow=already_slow,
        told_before=ahead is not None,
    )
    one = SlowdownDecision(
        entry,
        DetectionRule(),
        noticed=None if looked is None else at(entered - looked).mono,
        answered=None if ahead is None else at(entered - ahead).mono,
    )
    return one if after is None else replace(one, applied=at(entered + after))


def test_the_spread_is_that_of_the_nearest_ranks() -> None:
    hundred = [asked(number, after=0.01 * (number + 1)) for number in range(100)]

    told = acknowledgements_of(hundred, at(110))

    assert told.timed == 100
    assert told.p50_s == pytest.approx(0.50)
    assert told.p95_s == pytest.approx(0.95)
    assert told.p99_s == pytest.approx(0.99)
    assert told.echo_age_s == pytest.approx(110 - 99 - 1.0)


def test_an_answer_that_may_still_come_in_time_is_not_missed_yet() -> None:
    before = acknowledgements_of([asked()], at(ECHO_S))
    after = acknowledgements_of([asked()], at(ECHO_S + 0.1))

    assert (before.asked, before.missed) == (0, 0)
    assert (after.asked, after.missed) == (1, 1)
    assert after.asked_age_s == pytest.approx(ECHO_S + 0.1)


def test_a_robot_that_was_slow_for_something_else_has_nothing_to_echo() -> None:
    told = acknowledgements_of([asked(already_slow=True)], at(5))

    assert (told.timed, told.asked) == (0, 0)


def test_whoever_drives_into_a_known_ring_has_answered_but_is_not_timed() -> None:
    told = acknowledgements_of([asked(after=0.01, looked=None)], at(5))

    assert (told.timed, told.asked, told.missed) == (0, 1, 0)


def test_a_robot_that_was_ahead_is_timed_by_when_it_said_so() -> None:
    told = acknowledgements_of([asked(after=0.4, ahead=0.02, looked=0.15)], at(5))

    assert (told.timed, told.asked, told.missed) == (1, 1, 0)
    assert told.p50_s == pytest.approx(0.13)
    assert told.echo_age_s == pytest.approx(5.02)
