"""Wishes in, the gate's word out."""

import math

import pytest

from iveg.domain.geometry import REST, Twist2D
from iveg.robot.ros2.config import DriveConfig
from iveg.robot.ros2.drive import DriveTopics
from iveg.robot.ros2.input_faults import InputFaults, speed_of
from iveg.ros2 import cdr, geometry_msgs, std_msgs
from tests.unit.robot.ros2.said import stamp

AHEAD = geometry_msgs.Twist(
    geometry_msgs.Vector3(0.5, 0.1, 0.2), geometry_msgs.Vector3(0.3, 0.4, -0.2)
)


def topics(**drive: bool) -> tuple[DriveTopics, InputFaults]:
    input_faults = InputFaults()
    found = DriveTopics(DriveConfig(**drive), "/cmd_vel_nav", "base_link", input_faults)
    return found, input_faults


def wished(after: float, forward: float = 0.5) -> bytes:
    header = std_msgs.Header(stamp(after), "base_link")
    return cdr.write(
        geometry_msgs.TwistStamped(
            header, geometry_msgs.Twist(geometry_msgs.Vector3(forward))
        )
    )


def test_of_a_twist_what_wheels_can_do_is_read() -> None:
    found, _ = topics()

    assert found.read(cdr.write(AHEAD), 0.0) == Twist2D(0.5, -0.2)


@pytest.mark.parametrize(
    ("forward", "code"),
    [
        (math.nan, "not_a_number"),
        (-math.inf, "not_a_number"),
        (1e300, "absurd"),
        (-21.0, "absurd"),
    ],
)
def test_a_twist_that_nobody_can_mean_is_a_wish_to_rest(
    forward: float, code: str
) -> None:
    found, input_faults = topics()

    wish = found.read(
        cdr.write(geometry_msgs.Twist(geometry_msgs.Vector3(forward))), 5.0
    )

    assert wish == REST
    assert speed_of(input_faults.faults(5.0)) == (0.5, code)


def test_bytes_that_are_no_twist_are_a_wish_to_rest() -> None:
    found, input_faults = topics()

    assert found.read(b"\0\1\0\0", 5.0) == REST
    assert speed_of(input_faults.faults(5.0)) == (0.5, "too_short")


def test_a_stamped_twist_that_was_overtaken_is_dropped() -> None:
    found, input_faults = topics(stamped_in=True)

    first, late = found.read(wished(1.0), 0.0), found.read(wished(0.9), 0.1)

    assert (first, late) == (Twist2D(0.5, 0.0), None)
    assert speed_of(input_faults.faults(0.1)) == (0.5, "time_back")


def test_a_sender_whose_clock_was_set_back_is_believed() -> None:
    found, _ = topics(stamped_in=True)
    found.read(wished(1.0), 0.0)

    assert found.read(wished(-3600.0), 0.1) == Twist2D(0.5, 0.0)
    assert found.read(wished(-3599.9), 0.2) == Twist2D(0.5, 0.0)


def test_a_sender_that_stamps_nothing_is_believed() -> None:
    found, _ = topics(stamped_in=True)
    bare = cdr.write(geometry_msgs.TwistStamped(std_msgs.Header(), AHEAD))

    assert [found.read(bare, n / 10) for n in range(2)] == [Twist2D(0.5, -0.2)] * 2


def test_what_the_gate_says_is_written_as_the_base_wants_it() -> None:
    plain, _ = topics()
    stamped, _ = topics(stamped_out=True)
    twist = Twist2D(0.25, -0.5)

    bare = cdr.read(geometry_msgs.Twist, plain.write(twist, 12.5))
    whole = cdr.read(geometry_msgs.TwistStamped, stamped.write(twist, 12.5))

    assert (bare.linear.x, bare.angular.z, bare.linear.y) == (0.25, -0.5, 0.0)
    assert whole.twist == bare
    assert (whole.header.stamp.seconds, whole.header.frame_id) == (12.5, "base_link")
