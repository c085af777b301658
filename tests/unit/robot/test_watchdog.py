"""Feedback is as old as the report that it has seen."""

from iveg.robot.watchdog import Watchdog


def test_age_counts_from_when_the_seen_report_was_sent() -> None:
    watchdog = Watchdog(0.0, 1.0)
    watchdog.sent(7, 10.0)
    watchdog.heard(7, 10.4)
    assert watchdog.age(10.5) == 0.5


def test_a_repeated_number_does_not_make_it_younger_nor_an_older_one_older() -> None:
    watchdog = Watchdog(0.0, 1.0)
    watchdog.sent(7, 10.0)
    watchdog.sent(8, 10.5)
    watchdog.heard(8, 10.6)
    watchdog.heard(8, 12.0)
    watchdog.heard(7, 12.1)
    assert watchdog.age(12.5) == 2.0


def test_what_was_never_sent_is_no_evidence() -> None:
    watchdog = Watchdog(3.0, 1.0)
    watchdog.heard(None, 4.0)
    watchdog.heard(99, 4.0)
    assert watchdog.age(5.0) is None
    assert watchdog.silence(5.0) == 2.0


def test_reports_of_long_ago_are_forgotten_and_then_no_evidence() -> None:
    watchdog = Watchdog(0.0, 1.0)
    for seq in range(1000):
        watchdog.sent(seq, float(seq))
    watchdog.heard(1, 1000.0)
    assert watchdog.age(1000.0) is None


def feed(watchdog: Watchdog, start: float, count: int, every: float) -> float:
    now = start
    for number in range(count):
        now = start + number * every
        watchdog.sent(int(now * 100), now)
        watchdog.heard(int(now * 100), now)
    return now


def test_steady_is_two_seconds_and_four_messages() -> None:
    watchdog = Watchdog(0.0, 1.0)
    feed(watchdog, 0.0, 3, 0.9)
    assert not watchdog.steady(2.5)
    feed(watchdog, 2.6, 1, 0.1)
    assert watchdog.steady(2.6)


def test_an_interruption_starts_steadiness_anew() -> None:
    watchdog = Watchdog(0.0, 1.0)
    feed(watchdog, 0.0, 10, 0.2)
    feed(watchdog, 4.0, 9, 0.2)
    assert not watchdog.steady(5.9)
    feed(watchdog, 5.8, 2, 0.2)
    assert watchdog.steady(6.05)


def test_three_clears_a_minute_are_allowed() -> None:
    watchdog = Watchdog(0.0, 1.0)
    for at in (0.0, 10.0, 20.0):
        assert watchdog.may_clear(at)
        watchdog.cleared(at)
    assert not watchdog.may_clear(59.0)
    assert watchdog.may_clear(61.0)
