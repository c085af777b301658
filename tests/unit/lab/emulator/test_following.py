import math

import numpy as np
import pytest

from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.lab.emulator.following import CLEARANCE_M, Follower
from iveg.lab.emulator.greenhouse import Disc
from iveg.lab.emulator.kinematics import Vehicle
from iveg.lab.emulator.scripts import SPACING_M, Route, Station, route_of
from tests.builders import AGI, AGII

DT = 0.05
SQUARE = ((0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0))
LINE = ((0.0, 0.0), (8.0, 0.0))


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
        for _ in range(round(seconds / DT)):
            self.now += DT
            wish = self.follower.requested_twist(
                self.vehicle.pose, self.now, self.discs
            )
            self.vehicle.step(wish, DT)
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


def test_a_route_has_evenly_spaced_points_and_round_corners() -> None:
    points = route_of(SQUARE, 2.0, True).points
    steps = np.hypot(*np.diff(np.concatenate((points, points[:1])), axis=0).T)

    length = 4 * 4.0 + math.tau * 2.0
    assert steps.max() < SPACING_M * 1.05
    assert steps.sum() == pytest.approx(length, rel=0.01)
    assert np.hypot(points[:, 0] - 8.0, points[:, 1]).min() == pytest.approx(
        2.0 * (math.sqrt(2) - 1), abs=0.02
    )


@pytest.mark.parametrize(("profile", "radius"), [(AGI, 0.6), (AGII, 2.3)])
def test_a_robot_keeps_to_its_route_for_two_rounds(
    profile: RobotProfile, radius: float
) -> None:
    trip = Trip(profile, route_of(SQUARE, radius, True)).drive(90.0)

    driven = sum(abs(twist.linear_x) * DT for twist in trip.twists)
    assert driven > 50.0
    assert trip.farthest_off < 0.15


def test_agi_turns_on_the_spot_at_the_end_of_its_line_and_comes_back() -> None:
    trip = Trip(AGI, route_of(LINE, 0.0, False)).drive(22.0)

    assert max(p.x for p in trip.places) > 7.5
    assert trip.places[-1].x < 6.0
    assert min(twist.linear_x for twist in trip.twists) >= 0.0
    assert trip.farthest_off < 0.15


def test_agii_reverses_on_a_line_because_it_cannot_turn_there() -> None:
    trip = Trip(AGII, route_of(LINE, 0.0, False)).drive(30.0)

    assert trip.places[-1].x < 4.0
    assert min(twist.linear_x for twist in trip.twists) < -0.5
    assert max(abs(p.yaw) for p in trip.places) < 0.2


def test_a_robot_waits_before_a_person_and_goes_on_when_the_way_is_free() -> None:
    trip = Trip(AGI, route_of(SQUARE, 0.6, True), discs=(Disc(5.0, 0.0, 0.25),))
    trip.drive(20.0)
    nose_to_person = 5.0 - 0.25 - (trip.vehicle.pose.x + AGI.length / 2)

    assert trip.vehicle.twist.linear_x < 0.01
    assert CLEARANCE_M - 0.1 < nose_to_person < CLEARANCE_M + 0.35

    trip.discs = ()
    trip.drive(5.0)
    assert trip.vehicle.pose.x > 4.5


def test_a_person_beside_the_way_stops_nobody() -> None:
    trip = Trip(AGI, route_of(SQUARE, 0.6, True), discs=(Disc(4.0, 1.0, 0.25),))

    trip.drive(10.0)

    assert trip.vehicle.pose.x > 5.0


def test_a_robot_halts_at_a_station_for_its_dwell() -> None:
    route = route_of(SQUARE, 0.6, True)
    trip = Trip(AGI, route, stations=(Station(4.0, 0.0, dwell_s=5.0),))

    trip.drive(8.0)
    halted = trip.follower.at_station
    assert halted
    assert trip.vehicle.pose.x == pytest.approx(4.0, abs=0.25)
    assert trip.vehicle.twist.linear_x < 0.05

    trip.drive(7.0)
    gone_on = not trip.follower.at_station
    assert gone_on
    assert trip.vehicle.pose.x > 4.5


@pytest.mark.parametrize(
    ("arrival", "leaves"), [(0.0, 10.0), (9.5, 90.0), (20.0, 90.0)]
)
def test_a_timetable_says_when_a_robot_goes_on(arrival: float, leaves: float) -> None:
    station = Station(0.0, 0.0, dwell_s=1.0, period_s=80.0, offset_s=10.0)

    assert station.departure(arrival) == leaves


def test_the_intent_is_the_way_ahead_a_point_a_metre() -> None:
    trip = Trip(AGI, route_of(LINE, 0.0, False)).drive(2.0)

    path = trip.follower.path(4.0)

    assert len(path) == 4
    assert path[1][0] - path[0][0] == pytest.approx(1.0, abs=0.02)
