"""Laws of the plane that hold for every pose."""

import math

from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D, Rectangle, wrap_angle

metres = st.floats(-1e3, 1e3)
angles = st.floats(-50.0, 50.0)
poses = st.builds(Pose2D, metres, metres, angles)
fractions = st.floats(0.0, 1.0)


@given(angles)
def test_a_wrapped_angle_points_the_same_way_and_lies_in_one_turn(angle: float) -> None:
    wrapped = wrap_angle(angle)

    assert -math.pi <= wrapped <= math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)


@given(poses, metres, metres, metres, metres)
def test_frames_keep_distances(
    pose: Pose2D, ax: float, ay: float, bx: float, by: float
) -> None:
    (px, py), (qx, qy) = pose.transform(ax, ay), pose.transform(bx, by)

    before, after = math.hypot(bx - ax, by - ay), math.hypot(qx - px, qy - py)
    assert math.isclose(before, after, abs_tol=1e-6)


@given(poses, poses, metres, metres)
def test_composing_frames_is_transforming_twice(
    outer: Pose2D, inner: Pose2D, x: float, y: float
) -> None:
    twice = outer.transform(*inner.transform(x, y))
    once = outer.compose(inner).transform(x, y)

    assert math.dist(twice, once) < 1e-6


@given(poses, poses, fractions)
def test_an_interpolated_pose_lies_between_and_turns_less_than_half(
    a: Pose2D, b: Pose2D, fraction: float
) -> None:
    between = a.interpolate(b, fraction)
    whole = a.distance_to(b.x, b.y)

    assert math.isclose(
        a.distance_to(between.x, between.y), fraction * whole, abs_tol=1e-6
    )
    assert abs(wrap_angle(between.yaw - a.yaw)) <= math.pi * fraction + 1e-6


@given(metres, metres, metres, metres, fractions)
def test_a_segment_with_a_point_inside_a_rectangle_crosses_it(
    ax: float, ay: float, bx: float, by: float, fraction: float
) -> None:
    x, y = ax + fraction * (bx - ax), ay + fraction * (by - ay)
    around = Rectangle(x - 0.5, y - 0.5, x + 0.5, y + 0.5)

    assert around.crosses(ax, ay, bx, by)


@given(poses, metres, metres)
def test_a_segment_crosses_the_same_rectangles_both_ways(
    box: Pose2D, ax: float, ay: float
) -> None:
    area = Rectangle(box.x, box.y, box.x + 3.0, box.y + 2.0)
    # A corner that is only touched may be missed by a rounding error.
    grown = Rectangle(box.x - 1e-6, box.y - 1e-6, box.x + 3 + 1e-6, box.y + 2 + 1e-6)

    assert not area.crosses(ax, ay, 5.0, 5.0) or grown.crosses(5.0, 5.0, ax, ay)
    assert not area.crosses(5.0, 5.0, ax, ay) or grown.crosses(ax, ay, 5.0, 5.0)
