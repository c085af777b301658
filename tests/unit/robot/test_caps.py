"""The lowest cap counts: down at once, up late."""

from iveg.robot.caps import FREE, AppliedCap, Cap, lowest, quantised

HALF = Cap(0.5, "person", "p1")
ZERO = Cap(0.0, "watchdog")


def test_nothing_known_against_driving_is_free() -> None:
    assert lowest(()) == FREE


def test_at_equal_factors_a_person_is_told_first_and_one_with_a_name() -> None:
    told = lowest(
        (
            Cap(0.5, "watchdog"),
            Cap(0.5, "robot", "AGII"),
            Cap(0.5, "person"),
            HALF,
            Cap(0.5, "stale"),
        )
    )
    assert told == HALF


def test_factors_go_down_to_the_next_step() -> None:
    factors = [quantised(one) for one in (-1.0, 0.0, 0.49, 0.5, 0.99, 1.0, 2.0)]
    assert factors == [0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0]


def test_a_lower_cap_counts_at_once() -> None:
    assert AppliedCap(FREE).settle(HALF, 5.0).cap == HALF


def test_a_higher_cap_waits_a_second() -> None:
    applied = AppliedCap(HALF).settle(FREE, 5.0).settle(FREE, 5.95)
    assert applied.cap == HALF
    assert applied.settle(FREE, 6.0).cap == FREE


def test_one_relapse_starts_the_second_anew() -> None:
    applied = AppliedCap(HALF).settle(FREE, 5.0).settle(HALF, 5.9).settle(FREE, 6.0)
    assert applied.settle(FREE, 6.9).cap == HALF
    assert applied.settle(FREE, 7.0).cap == FREE


def test_what_came_lower_while_waiting_is_what_it_rises_to() -> None:
    applied = AppliedCap(ZERO).settle(FREE, 5.0).settle(HALF, 5.5).settle(FREE, 6.0)
    assert applied.cap == HALF
    assert applied.settle(FREE, 7.0).cap == FREE


def test_the_same_factor_with_another_reason_is_told_at_once() -> None:
    assert AppliedCap(HALF).settle(Cap(0.5, "stale"), 5.0).cap.reason == "stale"
