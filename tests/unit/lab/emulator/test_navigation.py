"""An emulated robot drives to a goal, and without one not on its own."""

from collections.abc import Sequence

import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.geometry import REST
from iveg.domain.goals import Goal, GoalKind
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.greenhouse import Scenery
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.ways import way_between
from iveg.lab.emulator.world import RobotHardware, SimulatedWorld
from iveg.robot.goals import NEAR_M
from tests.touching import touches

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


def test_a_robot_on_its_own_route_has_nothing_to_give_up() -> None:
    drive = Drive()
    drive.run(12.0)
    begun = drive.rig.vehicle.pose

    drive.rig.pursue(None, drive.world)
    drive.run(5.0)

    assert drive.away(begun.x, begun.y) > 1.0


def test_a_pause_stands_and_a_return_ends_on_its_own_route() -> None:
    drive = Drive()
    drive.run(14.0)
    assert drive.send(0.0, 0.0, "pause")
    drive.run(3.0)
    paused = drive.rig.vehicle.pose
    drive.run(10.0)
    assert drive.rig.vehicle.pose == paused

    start = TESTBED.starts[0]
    assert drive.send(start.x, start.y, "return")
    drive.run(60.0)

    drive.rig.pursue(None, drive.world)
    before = drive.rig.vehicle.pose
    drive.run(90.0)
    assert drive.away(before.x, before.y) > 0.0
    assert drive.rig.navigation().task in ("scouting", "waiting")
    assert drive.rig.navigation().path != ()


def test_a_robot_with_a_turning_radius_knows_its_own_route_alone() -> None:
    drive = Drive("AGII")

    assert not drive.send(2.0, 5.0)
    assert drive.rig.navigation().task == "hauling"
    assert drive.send(18.0, 10.0)
    drive.run(120.0)
    assert drive.away(18.0, 10.0) <= NEAR_M


def corners(
    start: tuple[float, float], goal: tuple[float, float]
) -> Sequence[tuple[float, float]] | None:
    return way_between(start, goal, Scenery.of(TESTBED), 0.3)


def test_a_way_begins_and_ends_where_it_should_and_goes_round_the_rows() -> None:
    way = corners((2.0, 10.0), (6.0, 10.0))

    assert way is not None
    assert (way[0], way[-1]) == ((2.0, 10.0), (6.0, 10.0))
    assert any(y < 3.5 or y > 16.5 for _, y in way)


def test_into_a_row_there_is_no_way() -> None:
    row = TESTBED.rows[0]
    middle = (row.xmin + row.xmax) / 2, (row.ymin + row.ymax) / 2
    wide = way_between((2.0, 10.0), middle, Scenery.of(TESTBED), 0.8)

    assert wide is None


def test_where_it_already_is_a_way_has_one_point() -> None:
    assert corners((2.0, 10.0), (2.0, 10.0)) == [(2.0, 10.0)]
