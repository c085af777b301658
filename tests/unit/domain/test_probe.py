"""How far the chain is behind, by iVeg's own probes."""

from iveg.domain.observations import Origin
from iveg.domain.probe import ProbeLag
from tests.builders import at


def probe(seq: int, stamp: str | None = None) -> Origin:
    return Origin("iveg", seq, stamp)


def sent(*moments: float) -> ProbeLag:
    """Probes 1, 2, … have left at these moments (s)."""
    lag = ProbeLag()
    for seq, moment in enumerate(moments, start=1):
        lag.sent(probe(seq, "a stamp"), at(moment))
    return lag


def test_nothing_is_known_before_the_first_probe() -> None:
    lag = ProbeLag()

    assert (lag.lag(at(5.0)), lag.is_known, lag.grows(at(5.0))) == (None, False, False)


def test_the_newest_probe_that_came_back_tells_the_lag() -> None:
    lag = sent(0.0, 2.0)
    lag.returned(probe(1), at(1.0))
    lag.returned(probe(2), at(2.25))

    assert lag.lag(at(3.0)) == 0.25
    assert lag.is_known


def test_a_probe_that_is_still_out_counts_with_its_age() -> None:
    lag = sent(0.0, 2.0, 4.0)
    lag.returned(probe(1), at(0.5))

    assert lag.lag(at(9.0)) == 7.0


def test_before_the_first_came_back_the_lag_is_only_a_lower_bound() -> None:
    lag = sent(0.0)

    assert (lag.lag(at(3.0)), lag.is_known) == (3.0, False)


def test_a_probe_that_was_passed_by_a_later_one_counts_no_more() -> None:
    lag = sent(0.0, 2.0)
    lag.returned(probe(2), at(2.5))

    assert lag.lag(at(60.0)) == 0.5


def test_a_straggler_does_not_replace_what_a_newer_one_said() -> None:
    lag = sent(0.0, 2.0)
    lag.returned(probe(2), at(2.5))
    lag.returned(probe(1), at(30.0))

    assert lag.lag(at(30.0)) == 0.5


def test_a_copy_that_comes_later_says_nothing() -> None:
    lag = sent(0.0)
    lag.returned(probe(1), at(0.5))
    lag.returned(probe(1), at(40.0))

    assert lag.lag(at(40.0)) == 0.5


def test_a_probe_that_comes_back_after_ten_minutes_is_matched() -> None:
    lag = sent(*(2.0 * n for n in range(300)))
    lag.returned(probe(1), at(600.0))

    assert (lag.lag(at(600.0)), lag.is_known) == (600.0, True)


def test_what_is_remembered_is_bounded() -> None:
    lag = sent(*(2.0 * n for n in range(2000)))

    assert lag.sent_at(probe(1)) is None
    assert lag.sent_at(probe(2000)) == at(3998.0).mono


def test_a_probe_of_an_earlier_life_says_nothing() -> None:
    lag = sent(0.0)
    lag.returned(Origin("before", 1), at(1.0))

    assert not lag.is_known


def backlog(*transits: float) -> ProbeLag:
    """Probes every two seconds that took so long (s)."""
    lag = sent(*(2.0 * n for n in range(len(transits))))
    for seq, transit in enumerate(transits):
        lag.returned(probe(seq + 1), at(2.0 * seq + transit))
    return lag


def test_a_backlog_that_gets_longer_grows() -> None:
    lag = backlog(*(0.3 * n for n in range(12)))

    assert lag.grows(at(25.3))


def test_a_backlog_that_stays_as_it_is_does_not_grow() -> None:
    lag = backlog(*[12.0] * 12)

    assert (lag.lag(at(34.0)), lag.grows(at(34.0))) == (12.0, False)


def test_a_backlog_that_drains_does_not_grow() -> None:
    lag = backlog(*(12.0 - n for n in range(12)))

    assert not lag.grows(at(23.0))


def test_a_chain_that_stops_grows() -> None:
    lag = sent(0.0, 2.0)
    lag.returned(probe(1), at(0.1))

    assert not lag.grows(at(2.2))
    assert lag.grows(at(5.0))
