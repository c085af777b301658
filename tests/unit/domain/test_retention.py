"""The moments before which rows may go, whatever the clock shows."""

import pytest

from iveg.domain.retention import DAY_S, SPARED_DAYS, Retention, cutoff, squeezed

TODAY = 19_000
NOW = (TODAY + 0.5) * DAY_S
EVERY_DAY = tuple(range(TODAY, TODAY - 500, -1))


def test_where_every_day_was_recorded_horizons_are_those_of_the_calendar() -> None:
    found = Retention().cutoffs(NOW, EVERY_DAY)

    assert found == {
        "positions": NOW - 7 * DAY_S,
        "telemetry": NOW - 30 * DAY_S,
        "decisions": NOW - 365 * DAY_S,
        "audit": NOW - 400 * DAY_S,
    }


def test_what_is_kept_for_ever_has_no_moment() -> None:
    assert Retention(0, 0, 0, 0).cutoffs(NOW, EVERY_DAY) == {}


def test_a_history_without_a_line_lets_nothing_go() -> None:
    assert Retention().cutoffs(NOW, ()) == {}


def test_a_weekend_counts_in_full() -> None:
    workdays = [day for day in EVERY_DAY if day % 7 < 5]

    for days in range(1, 60):
        found = cutoff(days, NOW, workdays)
        newest = workdays[0]
        assert found == min(NOW - days * DAY_S, (newest - days + 1) * DAY_S)


def test_a_longer_time_without_iveg_counts_for_three_days() -> None:
    after_a_summer = (TODAY, TODAY - 1, *EVERY_DAY[90:])

    assert cutoff(7, NOW, after_a_summer) == (TODAY - 92) * DAY_S


@pytest.mark.parametrize("years", [1, 5, 200])
def test_a_clock_that_is_years_ahead_takes_three_days_and_no_more(years: int) -> None:
    ahead = TODAY + years * 365
    recorded = (ahead, *EVERY_DAY)

    assert cutoff(7, ahead * DAY_S + 1.0, recorded) == (TODAY - 3) * DAY_S
    assert cutoff(365, ahead * DAY_S + 1.0, recorded) == (TODAY - 361) * DAY_S
    assert cutoff(SPARED_DAYS, ahead * DAY_S + 1.0, recorded) == TODAY * DAY_S


def test_a_clock_that_was_set_back_lets_less_go() -> None:
    assert cutoff(7, NOW - 100 * DAY_S, EVERY_DAY) == NOW - 107 * DAY_S


def test_a_clock_that_began_in_1970_takes_three_days_of_those_rows() -> None:
    recorded = [TODAY, TODAY - 1, 0]

    assert cutoff(5, NOW, recorded) == 0.0
    assert cutoff(4, NOW, recorded) == DAY_S
    assert cutoff(2, NOW, recorded[:2]) == NOW - 2 * DAY_S


def test_before_the_oldest_line_every_day_counts() -> None:
    month = EVERY_DAY[:30]

    assert cutoff(400, NOW, month) == NOW - 400 * DAY_S
    ahead = (TODAY + 9000) * DAY_S
    assert cutoff(400, ahead, (TODAY + 9000, *month)) == (TODAY - 396) * DAY_S


def test_a_low_disk_takes_the_oldest_day_of_telemetry_and_nothing_else() -> None:
    cutoffs = Retention().cutoffs(NOW, EVERY_DAY)
    oldest = NOW - 20.25 * DAY_S

    found = squeezed(cutoffs, oldest, NOW, EVERY_DAY)

    assert found == {**cutoffs, "telemetry": oldest + DAY_S}


def test_a_low_disk_spares_the_newest_days() -> None:
    for_ever = Retention(0, 0, 0, 0).cutoffs(NOW, EVERY_DAY)

    found = squeezed(for_ever, NOW - 1.5 * DAY_S, NOW, EVERY_DAY)

    assert found == {"telemetry": NOW - SPARED_DAYS * DAY_S}
    assert squeezed({}, None, NOW, EVERY_DAY) == {}


def test_a_low_disk_keeps_no_telemetry_beyond_its_time() -> None:
    cutoffs = Retention().cutoffs(NOW, EVERY_DAY)

    found = squeezed(cutoffs, NOW - 100 * DAY_S, NOW, EVERY_DAY)

    assert found == cutoffs
