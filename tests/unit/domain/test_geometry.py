"""Frames, headings and rectangles by worked example."""

import math

import numpy as np
import pytest

from iveg.domain.geometry import Box3D, Pose2D, Rectangle, wrap_angle
from iveg.domain.greenhouse import DriveLane, Greenhouse
from tests.builders import scan

QUARTER = math.pi / 2
BOX = Rectangle(1.0, 1.0, 2.0, 3.0)


def test_a_point_ahead_of_a_robot_that_looks_left_is_to_the_north() -> None:
    assert Pose2D(1.0, 2.0, QUARTER).transform(3.0, 0.0) == pytest.approx((1.0, 5.0))


def test_a_point_to_the_left_of_a_robot_that_looks_left_is_to_the_west() -> None:
    assert Pose2D(1.0, 2.0, QUARTER).transform(0.0, 1.0) == pytest.approx((0.0, 2.0))


def test_poses_compose_like_their_points() -> None:
    camera = Pose2D(1.0, 2.0, QUARTER).compose(Pose2D(0.4, 0.0, QUARTER))

    assert (camera.x, camera.y) == pytest.approx((1.0, 2.4))
    assert abs(camera.yaw) == pytest.approx(math.pi)


def test_half_way_between_two_headings_is_the_short_way_round() -> None:
    half = Pose2D(0, 0, math.radians(170)).interpolate(
        Pose2D(2, 4, math.radians(-170)), 0.5
    )

    assert (half.x, half.y) == (1.0, 2.0)
    assert abs(half.yaw) == pytest.approx(math.pi)


def test_angles_are_brought_into_one_turn() -> None:
    assert wrap_angle(3 * math.pi + 0.1) == pytest.approx(-math.pi + 0.1)


def test_the_centre_of_a_box_is_half_way_between_its_sides() -> None:
    assert Box3D(0, 2, 0, 4, 0, 6).centre == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("segment", "crosses"),
    [
        ((0, 2, 3, 2), True),
        ((0, 0, 3, 0.9), False),
        ((1.5, 0, 1.5, 4), True),
        ((0.5, 0, 0.5, 4), False),
        ((0, 2, 0.9, 2), False),
        ((1.5, 2, 1.6, 2.1), True),
        ((0, 2, 2, 4), True),
        ((1.5, 2, 1.5, 2), True),
        ((0, 3.2, 3, 3.2), False),
    ],
)
def test_a_segment_crosses_a_rectangle_or_passes_it(
    segment: tuple[float, float, float, float], crosses: bool
) -> None:
    assert BOX.crosses(*segment) is crosses


@pytest.mark.parametrize(
    ("x", "y", "margin", "inside"),
    [(1.0, 3.0, 0.0, True), (0.9, 2.0, 0.0, False), (0.9, 2.0, 0.2, True)],
)
def test_a_rectangle_holds_its_edges_and_a_margin(
    x: float, y: float, margin: float, inside: bool
) -> None:
    assert BOX.contains(x, y, margin) is inside


def test_a_lane_is_known_by_its_label() -> None:
    greenhouse = Greenhouse(
        "h", Rectangle(0, 0, 9, 9), lanes=(DriveLane("Pasillo 7", BOX),)
    )

    assert greenhouse.lane_at(1.5, 2.0) == "Pasillo 7"
    assert greenhouse.lane_at(5.0, 5.0) is None


def test_crop_hides_what_is_behind_it() -> None:
    greenhouse = Greenhouse("h", Rectangle(0, 0, 9, 9), rows=(BOX,))

    assert not greenhouse.in_sight(0, 2, 5, 2)
    assert greenhouse.in_sight(0, 5, 5, 5)


def test_a_scan_keeps_the_returns_that_count_and_turns_with_its_mount() -> None:
    swept = scan(
        ranges=[0.05, 2.0, float("inf"), float("nan"), 3.0],
        angle_increment=QUARTER,
        mount=Pose2D(1.0, 0.0, -QUARTER),
    )

    points = swept.points(Pose2D(0.0, 0.0, 0.0))

    assert points.dtype == np.float32
    np.testing.assert_allclose(points, [[3.0, 0.0], [1.0, -3.0]], atol=1e-6)
