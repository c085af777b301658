import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.lab.emulator.kinematics import Vehicle
from iveg.lab.emulator.odometer import Odometer
from tests.builders import AGI, AGII

DT = 1 / 30
ORIGIN = Pose2D(0.0, 0.0, 0.0)
REST = Twist2D(0.0, 0.0)


def drive(vehicle: Vehicle, command: Twist2D, seconds: float) -> None:
    for _ in range(round(seconds / DT)):
        vehicle.step(command, DT)


def test_a_vehicle_speeds_up_and_brakes_within_its_limits() -> None:
    vehicle = Vehicle(AGI, ORIGIN)

    drive(vehicle, Twist2D(1.0, 0.0), 1.0)
    after_a_second = vehicle.twist.linear_x
    drive(vehicle, Twist2D(1.0, 0.0), 2.0)
    x_at_full_speed = vehicle.pose.x
    drive(vehicle, REST, 2.0)

    assert after_a_second == pytest.approx(AGI.acceleration)
    assert vehicle.twist == REST
    assert vehicle.pose.x - x_at_full_speed == pytest.approx(0.5, abs=0.03)


def test_no_command_drives_faster_than_the_profile() -> None:
    vehicle = Vehicle(AGI, ORIGIN)

    drive(vehicle, Twist2D(9.0, 9.0), 5.0)

    assert vehicle.twist == Twist2D(AGI.max_speed, AGI.max_turn)


def test_agi_turns_on_the_spot() -> None:
    vehicle = Vehicle(AGI, ORIGIN)

    drive(vehicle, Twist2D(0.0, 1.0), 2.0)

    assert (vehicle.pose.x, vehicle.pose.y) == (0.0, 0.0)
    assert vehicle.pose.yaw > 1.0


def test_agii_cannot_turn_on_the_spot() -> None:
    vehicle = Vehicle(AGII, ORIGIN)

    drive(vehicle, Twist2D(0.0, 1.0), 2.0)

    assert vehicle.pose == ORIGIN


@given(
    commands=st.lists(
        st.tuples(st.floats(-1.0, 1.0), st.floats(-2.0, 2.0)), max_size=30
    )
)
def test_agii_never_turns_tighter_than_two_metres(
    commands: list[tuple[float, float]],
) -> None:
    vehicle = Vehicle(AGII, ORIGIN)

    for command in commands:
        drive(vehicle, Twist2D(*command), 0.2)
        twist = vehicle.twist
        assert abs(twist.angular_z) <= abs(twist.linear_x) / 2.0 + 1e-9


def test_agii_drives_a_circle_of_two_metres_radius() -> None:
    vehicle = Vehicle(AGII, ORIGIN)
    drive(vehicle, Twist2D(0.8, 0.4), 5.0)
    start = vehicle.pose

    drive(vehicle, Twist2D(0.8, 0.4), math.pi / 0.4)

    assert start.distance_to(vehicle.pose.x, vehicle.pose.y) == pytest.approx(
        4.0, abs=0.03
    )


def test_braking_keeps_the_wheels_of_agii_as_they_are() -> None:
    vehicle = Vehicle(AGII, ORIGIN)
    drive(vehicle, Twist2D(0.8, 0.4), 5.0)

    drive(vehicle, REST, 0.4)

    assert 0.0 < vehicle.twist.linear_x < 0.5
    assert vehicle.twist.angular_z == pytest.approx(vehicle.twist.linear_x / 2.0)


def test_odometry_errs_but_does_not_drift_away_in_an_hour() -> None:
    odometer = Odometer(np.random.default_rng(1))
    twist, truth, errors = Twist2D(0.8, 0.3), Pose2D(3.0, 4.0, 0.5), []

    for _ in range(36_000):
        believed = odometer.measure(truth, twist, 0.1)
        errors.append(truth.distance_to(believed.x, believed.y))

    early, late = np.array(errors[1_000:10_000]), np.array(errors[-9_000:])
    assert 0.01 < late.mean() < 0.08
    assert late.mean() < 2.0 * early.mean()
    assert max(errors) < 0.3


def test_a_standing_robot_reports_the_same_pose_for_ever() -> None:
    odometer = Odometer(np.random.default_rng(1))
    truth = Pose2D(3.0, 4.0, 0.5)
    first = odometer.measure(truth, Twist2D(0.8, 0.3), 1.0)

    for _ in range(100):
        assert odometer.measure(truth, REST, 0.1) == first


def test_odometry_errs_more_along_than_across() -> None:
    odometer = Odometer(np.random.default_rng(1))
    found = [odometer.measure(ORIGIN, Twist2D(0.8, 0.3), 0.5) for _ in range(5_000)]

    along, across = np.std([p.x for p in found]), np.std([p.y for p in found])
    assert along == pytest.approx(0.02 * 2.0, rel=0.15)
    assert across == pytest.approx(0.01 * 2.0, rel=0.15)


def test_odometry_errs_by_a_share_of_the_angle_turned() -> None:
    odometer = Odometer(np.random.default_rng(1))
    found = [odometer.measure(ORIGIN, Twist2D(0.0, 0.3), 0.5) for _ in range(5_000)]

    assert np.std([p.yaw for p in found]) == pytest.approx(0.03, rel=0.15)


def test_a_heading_error_is_forgotten_along_a_row() -> None:
    odometer = Odometer(np.random.default_rng(1))
    turned = odometer.measure(ORIGIN, Twist2D(0.0, 1.0), 3.0)
    for _ in range(20):
        along = odometer.measure(ORIGIN, Twist2D(1.0, 0.0), 0.5)

    assert abs(turned.yaw) > 0.001
    assert abs(along.yaw) < 0.01 * abs(turned.yaw)
