"""Frames, headings and rectangles by worked example."""

import math

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from tests.builders import scan

QUARTER = math.pi / 2
BOX = Rectangle(1.0, 1.0, 2.0, 3.0)


@pytest.mark.parametrize(
    ("x", "y", "margin", "inside"),
    [(1.0, 3.0, 0.0, True), (0.9, 2.0, 0.0, False), (0.9, 2.0, 0.2, True)],
)
def test_a_rectangle_holds_its_edges_and_a_margin(
    x: float, y: float, margin: float, inside: bool
) -> None:
    assert BOX.contains(x, y, margin) is inside


def test_crop_hides_what_is_behind_it() -> None:
    greenhouse = Greenhouse("h", Rectangle(0, 0, 9, 9), rows=(BOX,))

    assert not greenhouse.in_sight(0, 2, 5, 2)
    assert greenhouse.in_sight(0, 5, 5, 5)
    assert greenhouse.in_sight(0, 0, 3, 0.9), "past its corner"


def test_a_scan_keeps_the_returns_that_count_and_turns_with_its_mount() -> None:
    swept = scan(
        ranges=[0.05, 2.0, float("inf"), float("nan"), 3.0],
        angle_increment=QUARTER,
        mount=Pose2D(1.0, 0.0, -QUARTER),
    )

    points = swept.points(Pose2D(0.0, 0.0, 0.0))

    assert points.dtype == np.float32
    np.testing.assert_allclose(points, [[3.0, 0.0], [1.0, -3.0]], atol=1e-6)
