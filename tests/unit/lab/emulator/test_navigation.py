"""Robots move within their limits, follow their routes and drive to goals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import REST, Pose2D, Twist2D
from iveg.domain.goals import Goal, GoalKind
from iveg.lab.emulator.camera import DETECTORS
from iveg.lab.emulator.greenhouse import Disc
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.navigation import (
    CLEARANCE_M,
    Follower,
    Vehicle,
)
from iveg.lab.emulator.scenarios import Route, Station, route_of, scenario_named
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.robot.goals import NEAR_M
from tests.builders import AGI, AGII
from tests.touching import touches

DT = 1 / 30
ORIGIN = Pose2D(0.0, 0.0, 0.0)


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


TICK_S = 0.05
SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))


class Trip:
    """One vehicle on one route, with nobody but ``discs`` around."""

    def __init__(
        self,
        profile: RobotProfile,
        route: Route,
        stations: tuple[Station, ...] = (),
        discs: tuple[Disc, ...] = (),
    ) -> None:
        start = route.pose_at(0)
        self.route = route
        self.discs = discs
        self.vehicle = Vehicle(profile, start)
        self.follower = Follower(profile, route, start, 0.8, stations)
        self.now = 0.0
        self.places: list[Pose2D] = []
        self.twists: list[Twist2D] = []

    def drive(self, seconds: float) -> "Trip":
        for _ in range(round(seconds / TICK_S)):
            self.now += TICK_S
            wish = self.follower.requested_twist(
                self.vehicle.pose, self.now, self.discs
            )
            self.vehicle.step(wish, TICK_S)
            self.places.append(self.vehicle.pose)
            self.twists.append(self.vehicle.twist)
        return self

    @property
    def farthest_off(self) -> float:
        points = self.route.points
        return max(
            float(np.hypot(points[:, 0] - p.x, points[:, 1] - p.y).min())
            for p in self.places
        )


@pytest.mark.parametrize(("profile", "radius"), [(AGI, 0.6), (AGII, 2.3)])
def test_a_robot_keeps_to_its_route_for_two_rounds(
    profile: RobotProfile, radius: float
) -> None:
    trip = Trip(profile, route_of(SQUARE, radius, True)).drive(90.0)

    driven = sum(abs(twist.linear_x) * TICK_S for twist in trip.twists)
    assert driven > 50.0
    assert trip.farthest_off < 0.15


def test_a_robot_waits_before_a_person_and_goes_on_when_the_way_is_free() -> None:
    trip = Trip(AGI, route_of(SQUARE, 0.6, True), discs=(Disc(5.0, 0.0, 0.25),))
    trip.drive(20.0)
    nose_to_person = 5.0 - 0.25 - (trip.vehicle.pose.x + AGI.length / 2)

    assert trip.vehicle.twist.linear_x < 0.01
    assert CLEARANCE_M - 0.1 < nose_to_person < CLEARANCE_M + 0.35

    trip.discs = ()
    trip.drive(5.0)
    assert trip.vehicle.pose.x > 4.5


TESTBED = load_greenhouse("mvsim-20x20")
STEP_S = 0.1


class Drive:
    """One robot alone in the testbed."""

    def __init__(self, robot_id: str = "AGI") -> None:
        scenario = scenario_named("demo")
        layout = lay_out(scenario, (robot_id,), TESTBED)
        self.world = SimulatedWorld(TESTBED, layout, DETECTORS["perfect"], 1)
        self.world.people.clear()
        self.rig: RobotHardware = self.world.rigs[robot_id]
        self.now = 0.0

    def send(self, x: float, y: float, kind: GoalKind = "here") -> bool:
        return self.rig.pursue(Goal("01G", kind, x, y), self.world)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.now += STEP_S
            self.rig.drive(self.rig.requested_twist(self.now, self.world))
            self.rig.move(STEP_S)
            assert not touches(self.world.scenery, self.rig.vehicle.body("AGI"))

    def away(self, x: float, y: float) -> float:
        return self.rig.vehicle.pose.distance_to(x, y)


@pytest.mark.parametrize(
    "place", [(10.0, 12.0), (2.0, 5.0), (18.0, 10.0), (6.0, 10.0), (14.0, 18.0)]
)
def test_a_robot_drives_to_a_goal_touches_nothing_and_stays(
    place: tuple[float, float],
) -> None:
    drive = Drive()

    assert drive.send(*place)
    assert drive.rig.navigation().goal == place
    assert drive.rig.navigation().task == "goal"
    drive.run(70.0)

    assert drive.away(*place) <= NEAR_M
    drive.run(20.0)
    assert drive.away(*place) <= NEAR_M
    assert drive.rig.vehicle.twist == REST
    assert drive.rig.navigation().task == "waiting"


def test_a_robot_that_was_on_its_way_to_a_goal_stands_once_it_is_taken_away() -> None:
    drive = Drive()
    drive.send(2.0, 5.0)
    drive.run(6.0)

    drive.rig.pursue(None, drive.world)
    drive.run(3.0)
    stood = drive.rig.vehicle.pose
    drive.run(30.0)

    assert drive.rig.vehicle.pose == stood
    assert drive.rig.navigation().path == ()
    assert drive.send(10.0, 12.0)
    drive.run(60.0)
    assert drive.away(10.0, 12.0) <= NEAR_M


def test_a_robot_with_a_turning_radius_knows_its_own_route_alone() -> None:
    drive = Drive("AGII")

    assert not drive.send(2.0, 5.0)
    assert drive.rig.navigation().task == "hauling"
    assert drive.send(18.0, 10.0)
    drive.run(120.0)
    assert drive.away(18.0, 10.0) <= NEAR_M
