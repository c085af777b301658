"""What scans make of a grid, and how rings lie over it."""

import math

import pytest

from iveg.domain.costmap import (
    MAX_CELLS,
    UNKNOWN,
    Grid,
    InflatedGrid,
    Occupancy,
    sweep_of,
)
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.observations import LaserScan
from iveg.domain.rule.zones import Zone
from tests.builders import scan

ROOM = Grid.over(Rectangle(0, 0, 20, 10))


def ring(x: float, y: float, radius_m: float) -> Zone:
    return Zone("person", "P1", "AGI", x, y, radius_m)


def around(distance: float, beams: int = 720, range_max: float = 12.0) -> LaserScan:
    """A sweep that meets something at one distance all round."""
    return scan(
        ranges=[distance] * beams,
        angle_min=-math.pi,
        angle_increment=math.tau / beams,
        range_max=range_max,
    )


def seen(one: LaserScan, pose: Pose2D, grid: Grid = ROOM) -> InflatedGrid:
    occupancy = Occupancy(grid)
    occupancy.add(sweep_of(one, pose, grid))
    return occupancy.costs()


def cost(costmap: InflatedGrid, x: float, y: float) -> int:
    return int(costmap.data[costmap.grid.index(x, y)])


def test_a_large_greenhouse_gets_coarser_cells_and_no_more_of_them() -> None:
    grid = Grid.over(Rectangle(0, 0, 300, 100))

    assert grid.width * grid.height <= MAX_CELLS
    assert grid.width * grid.resolution == pytest.approx(300, abs=grid.resolution)


@pytest.mark.parametrize("yaw", [0.0, 1.0, -3.0])
def test_a_beam_frees_its_way_and_takes_its_end(yaw: float) -> None:
    costmap = seen(around(3.0), Pose2D(5.05, 5.05, yaw))

    assert cost(costmap, 7.05, 5.05) == 0
    assert cost(costmap, 8.05, 5.05) > 0
    assert cost(costmap, 8.55, 5.05) == UNKNOWN
    beyond = seen(around(12.5, range_max=12.0), Pose2D(10.0, 5.0, yaw))
    assert (beyond.data == UNKNOWN).all()


@pytest.mark.parametrize("turn", [1, -1])
def test_a_sweep_speaks_only_of_the_sector_that_it_looked_at(turn: int) -> None:
    """A quarter from straight ahead to the left, or to the right."""
    quarter = scan(
        ranges=[5.0] * 90, angle_increment=turn * math.pi / 180, range_max=12.0
    )

    costmap = seen(quarter, Pose2D(10.0, 5.0, 0.0))

    assert cost(costmap, 11.0, 5.0 + turn) == 0
    assert cost(costmap, 11.0, 5.0 - turn) == UNKNOWN
    assert cost(costmap, 9.0, 5.0) == UNKNOWN


def test_what_nobody_looks_at_any_more_fades_to_unknown() -> None:
    occupancy = Occupancy(ROOM)
    occupancy.fade(0.0)
    occupancy.add(sweep_of(around(3.0), Pose2D(5.05, 5.05, 0.0), ROOM))
    before = cost(occupancy.costs(), 8.05, 5.05)

    occupancy.fade(20.0)
    halved = cost(occupancy.costs(), 8.05, 5.05)
    occupancy.fade(200.0)

    assert halved == pytest.approx(before / 2, abs=1)
    assert (occupancy.costs().data == UNKNOWN).all()


def test_a_ring_is_laid_over_free_taken_and_unknown_cells() -> None:
    costmap = Occupancy(ROOM).costs([ring(5.05, 5.05, 2.0)])

    assert cost(costmap, 5.05, 5.05) == 99
    assert 50 <= cost(costmap, 6.95, 5.05) < 55
    assert cost(costmap, 7.25, 5.05) == UNKNOWN


@pytest.mark.parametrize("shift", [(3, 0), (0, -2), (-6, 5)])
def test_what_was_known_stays_in_its_place_when_the_window_moves(
    shift: tuple[int, int],
) -> None:
    before = Occupancy(ROOM)
    before.add(sweep_of(around(3.0), Pose2D(10.05, 5.05, 0.0), ROOM))
    dx, dy = shift

    after = before.moved_to(Grid.over(Rectangle(dx, dy, 20 + dx, 10 + dy))).costs()

    assert cost(after, 13.05, 5.05) == cost(before.costs(), 13.05, 5.05) > 0
    assert cost(after, 10.05, 5.05) == 0
