"""Ids are ULIDs: the alphabet, the moment first, then chance."""

from iveg.adapters import clock
from iveg.adapters.clock import new_id

DIGITS = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
AS_PYTHON = str.maketrans(DIGITS, "0123456789ABCDEFGHIJKLMNOPQRSTUV")


def test_ids_are_ulids_of_their_moment_and_all_different() -> None:
    before = int(1000 * clock.wall())
    ids = {new_id() for _ in range(2000)}
    after = int(1000 * clock.wall())

    assert {len(one) for one in ids} == {26}
    assert set("".join(ids)) <= set(DIGITS)
    moments = [int(one[:10].translate(AS_PYTHON), 32) for one in ids]
    assert before <= min(moments) <= max(moments) <= after
    assert len(ids) == 2000
