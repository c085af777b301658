"""Nothing younger than its horizon is ever deleted, whatever the clocks show."""

from dataclasses import dataclass

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.retention import DAY_S, GAP_DAYS, Retention, cutoff

_HOUR_S = 3600.0
_YEAR_S = 365 * DAY_S
_jumps = st.one_of(
    st.just(0.0),
    st.floats(-5 * _YEAR_S, 5 * _YEAR_S),
    st.floats(-2 * _HOUR_S, 2 * _HOUR_S),
)
_off = st.one_of(st.just(0.0), st.floats(0.0, 200 * DAY_S))


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the log.

    Attributes:
        at: By the clock then (Unix s).
        truly: When that really was (s).
    """

    at: float
    truly: float


def _recorded(lines: list[Line]) -> list[int]:
    return sorted({int(one.at // DAY_S) for one in lines}, reverse=True)


@given(
    st.lists(st.tuples(_off, _jumps), min_size=1, max_size=60),
    st.integers(1, 12),
    st.floats(10 * _YEAR_S, 60 * _YEAR_S),
)
def test_a_row_goes_only_when_it_is_older_than_its_horizon_but_for_jumps(
    hours: list[tuple[float, float]], days: int, start: float
) -> None:
    """A line each hour of running; between two of them iVeg is off, or a clock jumps.

    Each jump takes three days at most, whatever its size, and the day that it shows.
    """
    lines: list[Line] = []
    truly, error, jumps = 0.0, 0.0, 0
    for off, jump in hours:
        truly, error, jumps = truly + _HOUR_S + off, error + jump, jumps + (jump != 0.0)
        now = start + truly + error
        lines.append(Line(now, truly))
        recorded = _recorded(lines)

        before = cutoff(days, now, recorded)

        assert before <= now - days * DAY_S
        gone = [one for one in lines if one.at < before]
        for one in gone:
            assert now - one.at >= days * DAY_S
            true_days = (truly - one.truly) / DAY_S
            assert true_days > days - 1 - (GAP_DAYS + 1) * jumps
        lines = [one for one in lines if one not in gone]


@given(
    st.lists(st.integers(0, 30_000), min_size=1, unique=True),
    st.integers(1, 400),
    st.floats(0.0, 30_000 * DAY_S),
)
def test_no_gap_counts_for_more_than_three_days(
    days: list[int], horizon: int, now: float
) -> None:
    recorded = sorted(days, reverse=True)

    first = cutoff(horizon, now, recorded) / DAY_S

    # Days that are kept, and of each gap between them as much as counts.
    today = int(now // DAY_S)
    recorded = [today, *(day for day in recorded if day < today)]
    kept = [day for day in recorded if day + 1 > first]
    below = [day for day in recorded if day + 1 <= first][:1]
    gaps = zip(kept, [*kept[1:], *below], strict=False)
    counted = 1 + sum(min(a - b, GAP_DAYS) for a, b in gaps)
    assert not below or counted > horizon


@given(st.floats(0.0, 60 * _YEAR_S), st.integers(1, 400))
def test_of_any_two_kinds_the_one_that_is_kept_longer_goes_later(
    now: float, days: int
) -> None:
    day = int(now // DAY_S)
    recorded = tuple(range(day, day - 500, -3))
    kept = Retention(days, days + 1, days + 2, days + 3).cutoffs(now, recorded)

    assert kept["audit"] < kept["decisions"] < kept["telemetry"] < kept["positions"]
    assert kept["positions"] <= now - days * DAY_S
