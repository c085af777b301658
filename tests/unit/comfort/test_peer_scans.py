"""Scans go on to robots that ask, the newest of each peer and one at a time."""

import math
from dataclasses import replace

from iveg.comfort.maps import PeerScans
from iveg.domain.geometry import Pose2D
from iveg.domain.peer_scan import PeerScan
from tests.builders import at, ignore, safety_report, scan
from tests.unit.domain.scene import Scene


class Field(Scene):
    """Robots that sweep, and what goes on to their peers."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.told: list[PeerScan] = []
        self.part = PeerScans(self.world, ignore, self.told.append, "b")

    def laser(self, robot_id: str, *, placed: bool = True) -> None:
        robot = self.world.robot(robot_id)
        robot.scan = scan(robot_id, [3.0] * 360, angle_increment=math.tau / 360)
        robot.scan_received = at(self.now)
        robot.scan_pose = Pose2D(1.0, 2.0, 0.0) if placed else None

    def tell(self, robot_id: str, *, asks: bool) -> None:
        robot = self.world.robot(robot_id)
        robot.safety = replace(safety_report(robot_id), peer_scans=asks)
        robot.safety_received = at(self.now)

    def pass_s(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.now += 0.05
            self.part.tick(at(self.now))

    def heard(self) -> list[str]:
        found = [one.robot_id for one in self.told]
        self.told.clear()
        return found


def test_who_asks_is_told_of_its_peers_and_not_of_itself() -> None:
    field = Field()
    field.laser("AGI")
    field.laser("AGII")
    field.tell("AGII", asks=True)
    field.pass_s(0.2)

    (one,) = field.told
    assert (one.robot_id, one.origin.boot, one.origin.seq) == ("AGI", "b", 1)
    assert one.pose == Pose2D(1.0, 2.0, 0.0)
    assert 0.04 < one.age_s < 0.2


def test_a_peer_is_told_of_twice_a_second_at_most_and_each_scan_once() -> None:
    field = Field()
    for _ in range(40):
        field.laser("AGI")
        field.tell("AGII", asks=True)
        field.pass_s(0.05)
    often = len(field.heard())
    field.pass_s(1.0)

    assert 3 <= often <= 4
    assert len(field.heard()) <= 1


def test_a_scan_without_a_place_or_long_ago_is_not_sent() -> None:
    field = Field()
    field.laser("AGI", placed=False)
    field.tell("AGII", asks=True)
    field.pass_s(0.2)
    field.laser("AGI")
    field.now += 1.5
    field.tell("AGII", asks=True)
    field.pass_s(0.2)

    assert field.heard() == []
