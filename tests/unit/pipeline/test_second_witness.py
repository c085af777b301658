"""Scans are looked at beside the rule loop: the newest of each robot, one at a time."""

from itertools import chain

import pytest

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Instant, LaserScan, UnreadScan
from iveg.domain.robot_state import RobotState
from iveg.domain.rule.obstacles import Obstacles
from iveg.domain.witness import Plan
from iveg.pipeline.scans import ScanReader
from iveg.pipeline.second_witness import SecondWitness
from tests.builders import at, origin, scan
from tests.unit.domain.scene import Scene


class Looks(Obstacles):
    """Remembers whose scans were looked at; the scan of ``BAD`` breaks it."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene.world, scene.people, Plan.of(scene.greenhouse))
        self.looked: list[tuple[str, float]] = []
        self.unsure = False

    def is_unsure(self, robot_id: str) -> bool:
        return self.unsure or super().is_unsure(robot_id)

    def look(self, robot: RobotState, scan: LaserScan, now: Instant) -> None:
        self.looked.append((robot.robot_id, float(scan.ranges[0])))
        if robot.robot_id == "BAD":
            raise ValueError("broken")
        super().look(robot, scan, now)


class Field(Scene):
    """Robots that sweep."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.refused: list[tuple[str, str]] = []
        reader = ScanReader(lambda *one: self.refused.append(one[:2]))
        self.looks = Looks(self)
        self.part = SecondWitness(self.world, reader, self.looks)

    def laser(self, *robots: str, range_m: float = 3.0) -> None:
        for robot_id in robots:
            self.drive(robot_id, 5.0)
            robot = self.world.robot(robot_id)
            robot.scan, robot.scan_received = scan(robot_id, [range_m]), at(self.now)
            robot.scan_pose = Pose2D(5.0, 0.0, 0.0)

    def tick(self) -> list[tuple[str, float]]:
        self.now = round(self.now + 0.01, 6)
        self.part.tick(at(self.now))
        looked, self.looks.looked = self.looks.looked, []
        return looked


def test_never_two_in_one_turn_and_the_newest_of_each() -> None:
    field = Field()
    field.laser("AGI", "AGII")
    field.laser("AGI", range_m=4.0)
    found = [field.tick() for _ in range(3)]

    assert sorted(len(one) for one in found) == [0, 1, 1]
    assert sorted(chain.from_iterable(found)) == [("AGI", 4.0), ("AGII", 3.0)]


@pytest.mark.parametrize(
    ("robots", "unsure", "least", "most"),
    [(1, False, 4, 6), (1, True, 9, 11), (20, True, 4, 6)],
)
def test_who_sends_thirty_a_second_is_looked_at_five_times_or_ten_where_it_matters(
    robots: int, unsure: bool, least: int, most: int
) -> None:
    fleet = tuple(f"R{n}" for n in range(robots))
    field, looked = Field(robots=fleet), list[str]()
    field.looks.unsure = unsure
    for hundredth in range(100):
        if hundredth % 3 == 0:
            field.laser(*fleet)
        looked += [name for name, _ in field.tick()]
    assert all(least <= looked.count(name) <= most for name in fleet)


def test_one_robots_scan_ends_neither_the_part_nor_the_looks_of_others() -> None:
    field = Field(robots=("BAD", "ODD", "AGI"))
    field.laser("BAD", "ODD", "AGI")

    def unreadable() -> LaserScan:
        raise UnreadableError("bad_lidar_header", "no turn")

    field.world.robot("ODD").scan = UnreadScan("ODD", origin(), unreadable)
    found = list(chain.from_iterable(field.tick() for _ in range(4)))

    assert [name for name, _ in found] == ["BAD", "AGI"]
    assert field.refused == [("BAD", "undrawable_scan"), ("ODD", "bad_lidar_header")]


def test_what_is_old_is_no_witness() -> None:
    field = Field()
    field.laser("AGI")
    field.now = 0.6
    assert field.tick() == []
    field.laser("AGI")
    field.now = 2.0
    field.world.robot("AGI").scan_received = at(field.now)
    assert field.tick() == [], "nobody knows where the robot is"
