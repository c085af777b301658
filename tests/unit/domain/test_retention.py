"""The moments before which rows may go, whatever the clock shows."""

from iveg.domain.retention import DAY_S, Retention

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


def test_what_is_kept_for_ever_or_was_never_written_has_no_moment() -> None:
    assert Retention(0, 0, 0, 0).cutoffs(NOW, EVERY_DAY) == {}
    assert Retention().cutoffs(NOW, ()) == {}
