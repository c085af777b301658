"""Speed caps of a robot, its own foresight, and the gate before the drive."""

import math

import pytest

from iveg.domain.feedback import FeedbackAlert
from iveg.domain.fleet import CAUTIOUS
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.rule.paths import slows_within_s
from iveg.robot.gate import AppliedCap, Cap, Gate, lowest
from tests.unit.robot.rig import STEP_S, Rig, person

# --- caps -------------------------------------------------------------------------

HALF = Cap(0.5, "person", "p1")


def test_at_equal_factors_a_person_is_told_first_and_one_with_a_name() -> None:
    others = [Cap(0.5, reason) for reason in ("watchdog", "person", "stale")]
    assert lowest([*others, Cap(0.5, "robot", "AGII"), HALF]) == HALF


def test_the_same_factor_with_another_reason_is_told_at_once() -> None:
    assert AppliedCap(HALF).settle(Cap(0.5, "stale"), 5.0).cap.reason == "stale"


# --- lookahead --------------------------------------------------------------------

STILL = (0.0, 0.0)


def driving(*alerts: FeedbackAlert, speed: float = 1.0) -> Rig:
    """At the origin, straight ahead; iVeg itself limits nothing."""
    rig = Rig(foresight=True).drive_on()
    rig.wished, rig.alerts = Twist2D(speed, 0.0), alerts
    rig.run(1.5)
    return rig


def test_it_is_slow_at_the_ring_and_names_the_person() -> None:
    rig = driving(person(6.5, velocity=STILL))
    while rig.factor == 1.0 and rig.pose.x < 5.0:
        rig.pose = Pose2D(rig.pose.x + rig.speed.linear_x * STEP_S, 0.0, 0.0)
        rig.step()
    # The ring begins at 4.5; it looks five times a second.
    soon = 4.5 - 1.0 * slows_within_s(CAUTIOUS.braking, 1.0)
    assert rig.pose.x == pytest.approx(soon + 0.1, abs=0.2)
    assert (rig.factor, rig.reason) == (0.5, "person")
    assert rig.machine.cap.decision_id == "d-1"


def test_it_needs_no_network_while_what_it_was_told_is_young() -> None:
    rig = driving(person(4.0, velocity=STILL), speed=0.3)
    assert rig.factor == 1.0
    rig.speaks, rig.speed = False, Twist2D(1.0, 0.0)
    rig.obeys = False
    rig.run(0.4)
    rig.pose = Pose2D(1.4, 0.0, 0.0)
    rig.run(0.3)
    assert (rig.factor, rig.reason) == (0.5, "person")


# --- gate -------------------------------------------------------------------------

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


def test_a_change_of_direction_starts_from_rest() -> None:
    gate = open_gate()
    reach(gate, Twist2D(1.0, 0.0), 1.0, 4.0)
    gate.request_twist(Twist2D(-1.0, 0.0), 4.05)
    assert -0.06 < gate.output(1.0, True, 4.05).linear_x < 0.0


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_wish_that_is_no_number_is_a_wish_to_rest(wrong: float) -> None:
    assert reach(open_gate(), Twist2D(wrong, 0.0), 1.0, 2.0) == REST
    assert reach(open_gate(), Twist2D(0.5, wrong), 1.0, 2.0) == REST
