"""The last word before the drive."""

import math

import pytest

from iveg.domain.geometry import REST, Twist2D
from iveg.robot.gate import Gate

FORWARD = Twist2D(1.0, 0.5)


def open_gate() -> Gate:
    """A gate that upstream has already asked for rest; it is 1.0 s."""
    gate = Gate(1.0, 1.0)
    gate.output(1.0, True, 0.0)
    gate.output(1.0, True, 1.0)
    assert not gate.neutral_needed
    return gate


def reach(gate: Gate, wish: Twist2D, factor: float, until: float) -> Twist2D:
    out, now = REST, 1.0
    while now < until:
        now += 0.05
        gate.request_twist(wish, now)
        out = gate.output(factor, True, now)
    return out


def test_speed_grows_by_half_a_metre_per_second_squared_and_keeps_the_curve() -> None:
    out = reach(open_gate(), FORWARD, 1.0, 2.0)
    assert out.linear_x == pytest.approx(0.5, abs=0.03)
    assert out.angular_z == pytest.approx(out.linear_x / 2)


def test_a_lower_factor_counts_at_once_forward_reverse_and_turning() -> None:
    gate = open_gate()
    assert reach(gate, Twist2D(-1.0, -0.5), 1.0, 4.0) == Twist2D(-1.0, -0.5)
    assert gate.output(0.5, True, 4.05) == Twist2D(-0.5, -0.25)
    assert gate.output(0.0, True, 4.1) == REST


def test_a_change_of_direction_starts_from_rest() -> None:
    gate = open_gate()
    reach(gate, Twist2D(1.0, 0.0), 1.0, 4.0)
    gate.request_twist(Twist2D(-1.0, 0.0), 4.05)
    assert -0.06 < gate.output(1.0, True, 4.05).linear_x < 0.0


def test_a_turn_on_the_spot_is_capped_and_ramped() -> None:
    gate = open_gate()
    out = reach(gate, Twist2D(0.0, 1.0), 0.5, 1.1)
    assert 0.0 < out.angular_z < 0.5
    gate.request_twist(Twist2D(0.0, 1.0), 2.0)
    for number in range(10):
        out = gate.output(0.5, True, 2.0 + number / 20)
    assert out.angular_z == 0.5


def test_a_wish_beyond_the_drive_is_cut_and_keeps_its_curve() -> None:
    out = reach(open_gate(), Twist2D(4.0, 1.0), 1.0, 5.0)
    assert out == Twist2D(1.0, 0.25)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_wish_that_is_no_number_is_a_wish_to_rest(wrong: float) -> None:
    assert reach(open_gate(), Twist2D(wrong, 0.0), 1.0, 2.0) == REST
    assert reach(open_gate(), Twist2D(0.5, wrong), 1.0, 2.0) == REST


def test_a_wish_is_forgotten_after_half_a_second() -> None:
    gate = open_gate()
    reach(gate, FORWARD, 1.0, 4.0)
    assert gate.output(1.0, True, 4.3) != REST
    assert gate.output(1.0, True, 4.7) == REST


def test_a_pause_of_the_program_does_not_make_the_robot_jump() -> None:
    gate = open_gate()
    gate.request_twist(FORWARD, 60.0)
    assert gate.output(1.0, True, 60.0).linear_x <= 0.05


def test_the_neutral_interlock_starts_anew_with_every_wish_to_move() -> None:
    gate = Gate(1.0, 1.0)
    for now, wish in ((0.0, REST), (0.4, FORWARD), (0.45, REST), (0.9, REST)):
        gate.request_twist(wish, now)
        assert gate.output(1.0, True, now) == REST
    assert gate.neutral_needed
    gate.output(1.0, True, 0.96)
    assert not gate.neutral_needed


def test_rest_while_held_does_not_count_for_the_interlock() -> None:
    gate = Gate(1.0, 1.0)
    for tick in range(40):
        gate.output(1.0, False, tick / 20)
    gate.output(1.0, True, 2.0)
    assert gate.neutral_needed


def test_a_held_gate_gives_zero_whatever_is_wished() -> None:
    gate = open_gate()
    reach(gate, FORWARD, 1.0, 4.0)
    gate.request_twist(FORWARD, 4.05)
    assert gate.output(1.0, False, 4.05) == REST
