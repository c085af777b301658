"""Order by (boot, seq) alone."""

import pytest

from iveg.domain.observations import Origin
from iveg.domain.stream_order import StreamOrder
from tests.builders import origin

YEARS_S = 5 * 365 * 86400.0


def test_the_same_message_again_is_a_duplicate_and_an_older_one_late() -> None:
    order = StreamOrder()
    order.judge(origin(5), 0.0)
    order.judge(origin(7), 0.0)

    assert [order.judge(origin(seq), 0.0) for seq in (7, 5)] == ["duplicate"] * 2
    assert order.judge(origin(6), 0.0) == "late"
    assert order.seq == 7


def test_the_newest_is_never_new_twice_however_many_late_ones_came_between() -> None:
    order = StreamOrder()
    order.judge(origin(1000), 0.0)
    for seq in range(200):
        order.judge(origin(seq), 0.0)

    assert order.judge(origin(1000), 0.0) != "new"


def test_a_straggler_of_an_unseen_boot_does_not_silence_the_living_one() -> None:
    order = StreamOrder()
    order.judge(origin(1, boot="living"), 0.0)
    order.judge(origin(900, boot="straggler"), 0.0)

    verdicts = [order.judge(origin(seq, boot="living"), seq / 2) for seq in range(2, 6)]

    assert verdicts == ["late"] * 2 + ["new"] * 2


def test_an_old_boot_does_not_come_back_by_repeating_itself_or_beside_the_present() -> (
    None
):
    order = StreamOrder()
    for seq in range(10):
        order.judge(origin(seq, boot="old"), 0.0)
    order.judge(origin(1, boot="new"), 0.0)

    assert {order.judge(origin(seq, boot="old"), 0.0) for seq in range(10)} == {"late"}
    for seq in range(2, 50):
        order.judge(origin(seq, boot="new"), 0.0)
        order.judge(origin(100 + seq, boot="old"), float(seq))
    assert (order.boot, order.seq) == ("new", 49)


@pytest.mark.parametrize("nameless", [Origin(), Origin("a"), Origin(None, 3)])
def test_a_message_without_identity_is_new_by_arrival(nameless: Origin) -> None:
    order = StreamOrder()
    order.judge(origin(7), 0.0)

    assert [order.judge(nameless, 0.0) for _ in range(2)] == ["new"] * 2
    assert order.seq == 7
