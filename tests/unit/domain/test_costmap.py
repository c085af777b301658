"""What scans make of a grid, and how rings lie over it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.costmap import UNKNOWN, InflatedGrid, Occupancy
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.mapped_area import window_round
from iveg.domain.observations import LaserScan
from iveg.domain.occupancy_grid import MAX_CELLS, Grid
from iveg.domain.rule.zones import Zone
from iveg.domain.sweeps import sweep_of
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


def test_a_greenhouse_is_covered_in_cells_of_a_tenth_of_a_metre() -> None:
    assert (ROOM.width, ROOM.height, ROOM.resolution) == (200, 100, 0.1)


def test_a_large_greenhouse_gets_coarser_cells_and_no_more_of_them() -> None:
    grid = Grid.over(Rectangle(0, 0, 300, 100))

    assert grid.width * grid.height <= MAX_CELLS
    assert grid.width * grid.resolution == pytest.approx(300, abs=grid.resolution)


def test_what_nobody_has_looked_at_is_unknown() -> None:
    costmap = seen(around(3.0), Pose2D(5.0, 5.0, 0.0))

    assert cost(costmap, 15.0, 5.0) == UNKNOWN


@pytest.mark.parametrize("yaw", [0.0, 1.0, -3.0])
def test_a_beam_frees_its_way_and_takes_its_end(yaw: float) -> None:
    costmap = seen(around(3.0), Pose2D(5.05, 5.05, yaw))

    assert cost(costmap, 7.05, 5.05) == 0
    assert cost(costmap, 8.05, 5.05) > 0
    assert cost(costmap, 8.55, 5.05) == UNKNOWN


def test_a_beam_that_found_nothing_frees_all_its_way_and_takes_nothing() -> None:
    costmap = seen(around(math.inf, range_max=4.0), Pose2D(5.0, 5.0, 0.0))

    assert cost(costmap, 8.0, 5.0) == 0
    assert costmap.data.max() == 0


def test_a_return_from_the_robot_itself_says_nothing() -> None:
    costmap = seen(around(0.05), Pose2D(5.0, 5.0, 0.0))

    assert (costmap.data == UNKNOWN).all()


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


def test_the_mount_of_the_laser_counts() -> None:
    ahead = scan(ranges=[2.0], angle_increment=0.1, mount=Pose2D(1.0, 0.0, math.pi / 2))

    costmap = seen(ahead, Pose2D(5.05, 5.05, 0.0))

    assert cost(costmap, 6.05, 7.05) > 0


def test_what_went_away_is_free_again_after_a_few_looks() -> None:
    occupancy, pose = Occupancy(ROOM), Pose2D(5.05, 5.05, 0.0)
    for _ in range(20):
        occupancy.add(sweep_of(around(3.0), pose, ROOM))
    for _ in range(10):
        occupancy.add(sweep_of(around(6.0), pose, ROOM))

    assert cost(occupancy.costs(), 8.05, 5.05) == 0


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


def test_a_ring_makes_no_cell_cheaper() -> None:
    occupancy = Occupancy(ROOM)
    for _ in range(10):
        occupancy.add(sweep_of(around(3.0), Pose2D(5.05, 5.05, 0.0), ROOM))

    costmap = occupancy.costs([ring(9.0, 5.05, 2.0)])

    assert cost(costmap, 8.05, 5.05) == 100


@given(
    x=st.floats(-30, 50),
    y=st.floats(-30, 40),
    yaw=st.floats(-4, 4),
    ranges=st.lists(
        st.floats(0, 40, width=32) | st.just(math.inf), min_size=1, max_size=40
    ),
    step=st.floats(0.01, 1.0) | st.floats(-1.0, -0.01),
)
def test_any_scan_from_anywhere_leaves_costs_in_their_range(
    x: float, y: float, yaw: float, ranges: list[float], step: float
) -> None:
    one = scan(ranges=ranges, angle_increment=step)

    costmap = Occupancy(ROOM)
    costmap.add(sweep_of(one, Pose2D(x, y, yaw), ROOM))

    data = costmap.costs([ring(x, y, 2.0)]).data
    assert data.shape == (100, 200)
    assert data.min() >= UNKNOWN
    assert data.max() <= 100


def test_an_open_field_is_mapped_round_the_robots() -> None:
    grid = window_round([Pose2D(100.0, -50.0, 0.0)], None)

    assert grid is not None
    assert (grid.xmin, grid.ymin) == (80.0, -70.0)
    assert (grid.width, grid.height) == (400, 400)


def test_the_window_stays_while_the_robots_are_well_inside() -> None:
    grid = window_round([Pose2D(0.0, 0.0, 0.0)], None)

    assert window_round([Pose2D(11.0, 0.0, 0.0)], grid) == grid
    assert window_round([Pose2D(13.0, 0.0, 0.0)], grid) != grid
    assert window_round([], grid) == grid


def test_the_window_of_a_scattered_fleet_is_bounded() -> None:
    grid = window_round([Pose2D(-500.0, 0.0, 0.0), Pose2D(500.0, 0.0, 0.0)], None)

    assert grid is not None
    assert grid.width * grid.resolution <= 61.0


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


def test_a_window_that_moves_far_away_knows_nothing() -> None:
    before = Occupancy(ROOM)
    before.add(sweep_of(around(3.0), Pose2D(10.05, 5.05, 0.0), ROOM))

    after = before.moved_to(Grid.over(Rectangle(100, 0, 120, 10))).costs()

    assert (after.data == UNKNOWN).all()
