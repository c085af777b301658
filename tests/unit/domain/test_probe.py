"""How far the chain is behind, by iVeg's own probes."""

import pytest

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


def test_before_the_first_came_back_the_lag_is_a_lower_bound_at_most() -> None:
    none, one = ProbeLag(), sent(0.0)

    assert (none.lag(at(5.0)), none.is_known) == (None, False)
    assert (one.lag(at(3.0)), one.is_known) == (3.0, False)


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


@pytest.mark.parametrize("later", [probe(1), probe(2), Origin("before", 9)])
def test_a_copy_a_straggler_or_a_probe_of_an_earlier_life_says_nothing(
    later: Origin,
) -> None:
    lag = sent(0.0, 2.0)
    lag.returned(probe(2), at(2.5))
    assert lag.lag(at(30.0)) == 0.5, "the first was passed by"
    lag.returned(later, at(40.0))

    assert lag.lag(at(40.0)) == 0.5
