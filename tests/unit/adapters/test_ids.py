"""Ids are ULIDs: the alphabet, the moment first, then chance."""

from iveg.adapters import clock
from iveg.adapters.clock import new_id

DIGITS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"


def milliseconds_of(ulid: str) -> int:
    """Its first ten digits."""
    value = 0
    for digit in ulid[:10]:
        value = 32 * value + DIGITS.index(digit)
    return value


def test_an_id_is_a_ulid_of_this_moment() -> None:
    before = int(1000 * clock.wall())
    ulid = new_id()
    after = int(1000 * clock.wall())

    assert len(ulid) == 26
    assert set(ulid) <= set(DIGITS)
    assert before <= milliseconds_of(ulid) <= after


def test_no_id_is_given_twice() -> None:
    assert len({new_id() for _ in range(2000)}) == 2000
