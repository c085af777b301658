"""Order by (boot, seq) alone."""

import pytest

from iveg.domain.observations import Origin
from iveg.domain.stream_order import StreamOrder
from tests.builders import START, origin

YEARS_S = 5 * 365 * 86400.0


def test_the_same_message_again_is_a_duplicate_and_an_older_one_late() -> None:
    order = StreamOrder()
    order.judge(origin(5))
    order.judge(origin(7))

    assert [order.judge(origin(seq)) for seq in (7, 5)] == ["duplicate"] * 2
    assert order.judge(origin(6)) == "late"
    assert order.seq == 7


def test_the_newest_is_never_new_twice_however_many_late_ones_came_between() -> None:
    order = StreamOrder()
    order.judge(origin(1000))
    for seq in range(200):
        order.judge(origin(seq))

    assert order.judge(origin(1000)) != "new"


LEAP = 10**6


def test_one_number_that_leaps_makes_no_true_one_late() -> None:
    order = StreamOrder()
    order.judge(origin(1))

    said = [order.judge(origin(seq)) for seq in (2, 2**53, 3, 4, LEAP, 5)]

    assert said == ["new", "late", "new", "new", "late", "new"]


def test_a_leap_from_which_five_in_a_row_go_on_is_believed() -> None:
    order = StreamOrder()
    order.judge(origin(1))

    said = [order.judge(origin(LEAP + number)) for number in range(6)]

    assert said == ["late"] * 4 + ["new"] * 2
    assert order.judge(origin(2)) == "late"


def test_a_leap_that_true_numbers_interrupt_is_not_believed() -> None:
    order = StreamOrder()
    order.judge(origin(1))
    said = []
    for number in range(10):
        said.append(order.judge(origin(LEAP + number)))
        order.judge(origin(2 + number))

    assert said == ["late"] * 10


def test_an_hour_that_nobody_heard_is_no_leap() -> None:
    order = StreamOrder()
    order.judge(origin(1))

    assert order.judge(origin(100_001)) == "new"


def test_a_straggler_of_an_unseen_boot_does_not_silence_the_living_one() -> None:
    order = StreamOrder()
    order.judge(origin(1, boot="living"))
    order.judge(origin(900, boot="straggler"))

    verdicts = [order.judge(origin(seq, boot="living")) for seq in range(2, 8)]

    assert verdicts == ["late"] * 4 + ["new"] * 2


def test_an_old_boot_that_repeats_itself_does_not_come_back() -> None:
    order = StreamOrder()
    for seq in range(10):
        order.judge(origin(seq, boot="old"))
    order.judge(origin(1, boot="new"))

    assert {order.judge(origin(seq, boot="old")) for seq in range(10)} == {"late"}
    assert order.boot == "new"


def test_an_old_boot_does_not_come_back_while_the_present_one_speaks() -> None:
    order = StreamOrder()
    order.judge(origin(1, boot="old"))
    for seq in range(50):
        order.judge(origin(seq, boot="new"))
        order.judge(origin(100 + seq, boot="old"))

    assert (order.boot, order.seq) == ("new", 49)


@pytest.mark.parametrize("nameless", [Origin(), Origin("a"), Origin(None, 3)])
def test_a_message_without_identity_is_new_by_arrival(nameless: Origin) -> None:
    order = StreamOrder()
    order.judge(origin(7))

    assert [order.judge(nameless) for _ in range(2)] == ["new"] * 2
    assert order.seq == 7


def test_a_stamp_years_off_orders_nothing() -> None:
    order = StreamOrder()
    order.judge(origin(1, wall=START.wall + YEARS_S))

    assert order.judge(origin(2, wall=START.wall)) == "new"
    assert order.judge(origin(1, wall=START.wall + 2 * YEARS_S)) == "duplicate"
