"""When alerts come faster than a person can take them in (ISA-18.2)."""

from iveg.domain.alerts.flood import FLOOD_LIMIT, FLOOD_OVER, FLOOD_WINDOW_S, FloodGauge
from tests.builders import at


def test_as_many_as_the_limit_are_no_flood_and_one_more_is() -> None:
    gauge = FloodGauge()

    assert gauge.count(FLOOD_LIMIT, at(0)).since is None
    assert gauge.count(1, at(9)).since == at(9)
    assert gauge.flood.count == FLOOD_LIMIT + 1


def test_a_flood_is_over_when_fewer_than_five_are_left_in_the_window() -> None:
    gauge = FloodGauge()
    gauge.count(FLOOD_LIMIT + 1, at(0))
    gauge.count(FLOOD_OVER, at(100))

    assert gauge.count(0, at(FLOOD_WINDOW_S)).since == at(0)
    assert gauge.count(0, at(FLOOD_WINDOW_S + 99)).count == FLOOD_OVER
    over = gauge.count(0, at(FLOOD_WINDOW_S + 100))
    assert (over.count, over.since) == (0, None)


def test_between_both_limits_a_flood_goes_on_and_none_begins() -> None:
    calm, flooded = FloodGauge(), FloodGauge()
    flooded.count(FLOOD_LIMIT + 1, at(0))
    flooded.count(FLOOD_OVER + 1, at(100))

    assert calm.count(FLOOD_OVER + 1, at(100)).since is None
    assert flooded.count(0, at(FLOOD_WINDOW_S)).since == at(0)


def test_a_storm_takes_no_more_room_than_a_flood() -> None:
    gauge = FloodGauge()

    assert gauge.count(100_000, at(0)).count == 1000
