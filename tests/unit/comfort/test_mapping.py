"""Which scans become the costmap, and what each robot believes."""

import math

from iveg.comfort.maps import Mapper
from iveg.domain.costmap import InflatedGrid
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.rule.zones import Zone
from tests.builders import at, ignore, scan
from tests.unit.domain.scene import Scene

ROOM = Rectangle(0, 0, 20, 20)
OPEN_FIELD = Rectangle(-1e6, -1e6, 1e6, 1e6)
PERSON = Zone("person", "P1", "AGI", 15.0, 15.0, 2.0)


class Field(Scene):
    """Robots that sweep, and the mapper beside them."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.mapper = Mapper(self.world, ROOM, ignore)

    def sweep_from(self, robot_id: str, x: float, y: float = 5.0) -> None:
        """Something stands three metres off all round."""
        self.drive(robot_id, x, y)
        robot = self.world.robot(robot_id)
        robot.scan = scan(
            robot_id, [3.0] * 360, angle_increment=math.tau / 360, range_max=12.0
        )
        robot.scan_pose = Pose2D(x, y, 0.0)

    def tick(self) -> None:
        self.mapper.tick(at(self.now))

    def shared(self, *zones: Zone) -> InflatedGrid:
        found = self.mapper.shared(zones, at(self.now))
        assert found is not None
        return found

    def of(self, robot_id: str, *zones: Zone) -> InflatedGrid:
        found = self.mapper.of_robot(robot_id, zones, at(self.now))
        assert found is not None
        return found


def knows(costmap: InflatedGrid, x: float, y: float = 5.0) -> bool:
    return bool(costmap.data[costmap.grid.index(x, y)] >= 0)


def test_scans_of_all_robots_make_one_costmap() -> None:
    field = Field()
    field.sweep_from("AGI", 5.0)
    field.sweep_from("AGII", 15.0)
    field.tick()
    field.tick()

    assert knows(field.shared(), 6.0)
    assert knows(field.shared(), 16.0)


def test_a_robot_believes_what_it_was_told_of_others_and_is_none_to_itself() -> None:
    field = Field()
    field.sweep_from("AGI", 5.0)
    field.tick()
    itself = Zone("robot", "AGI", "AGI", 12.0, 12.0, 2.0)

    believed = field.of("AGI", PERSON, itself)

    assert knows(believed, 15.0, 15.0)
    assert not knows(believed, 12.0, 12.0)
    assert knows(field.shared(itself), 12.0, 12.0)


def test_whom_a_recording_saw_is_not_laid_over_today() -> None:
    field = Field()
    field.sweep_from("AGI", 5.0)
    field.tick()
    recorded = Zone("person", "P1", "AGI", 15.0, 15.0, 2.0, recording="D1")

    assert not knows(field.shared(recorded), 15.0, 15.0)


def test_f60_a_scan_that_cannot_be_drawn_is_refused_and_the_others_are_drawn() -> None:
    field, refused = Field(), list[tuple[str, str]]()
    field.mapper = Mapper(
        field.world, ROOM, lambda robot, why, _: refused.append((robot, why))
    )
    field.sweep_from("AGI", 5.0)
    field.sweep_from("AGII", 15.0)
    flat = scan("AGI", [3.0] * 360, angle_increment=0.0, range_max=12.0)
    field.world.robot("AGI").scan = flat
    field.tick()
    field.tick()

    assert refused == [("AGI", "undrawable_scan")]
    assert knows(field.shared(), 16.0)


def test_in_an_open_field_the_costmap_goes_with_the_robots() -> None:
    field = Field()
    field.mapper = Mapper(field.world, OPEN_FIELD, ignore)
    field.sweep_from("AGI", 500.0)
    field.tick()
    first = field.shared().grid
    field.now = 0.5
    field.sweep_from("AGI", 515.0)
    field.tick()

    assert field.shared().grid.xmin > first.xmin
    assert knows(field.shared(), 501.0)
    assert knows(field.shared(), 516.0)
