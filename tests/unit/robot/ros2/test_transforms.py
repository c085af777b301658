"""The TF tree: through it, between two moments, and what it says when it cannot."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.geometry import Pose2D
from iveg.robot.ros2.transforms import NoTransformError, TransformBuffer
from iveg.ros2 import messages as ros
from tests.unit.robot.ros2.said import WALL, link, stamp, tf

SMALL = st.floats(-10, 10)
ANGLE = st.floats(-3.1, 3.1)
TURN = st.floats(-0.5, 0.5)
"""Between two transforms (rad)."""


def tree(*moving: ros.TransformStamped) -> TransformBuffer:
    found = TransformBuffer(0.5)
    found.add(tf(link("base_link", "laser", 0.3, 0.0, math.pi / 2)), static=True)
    found.add(tf(*moving), static=False)
    return found


def test_a_chain_is_followed_up_and_down() -> None:
    found = tree(link("map", "odom", 10.0), link("odom", "base_link", 1.0, 2.0))

    laser = found.lookup("map", "laser", WALL).flat()
    back = found.lookup("laser", "map", WALL).flat()

    assert (laser.x, laser.y, laser.yaw) == pytest.approx((11.3, 2.0, math.pi / 2))
    assert laser.compose(back).x == pytest.approx(0.0)


@given(SMALL, SMALL, ANGLE, SMALL, SMALL, TURN, st.floats(0.0, 1.0))
def test_interpolation_is_that_of_poses_on_the_floor(
    x0: float, y0: float, a0: float, x1: float, y1: float, turn: float, part: float
) -> None:
    a1 = a0 + turn
    found = tree(
        link("map", "odom", x0, y0, a0), link("map", "odom", x1, y1, a1, after=1.0)
    )
    flat = Pose2D(x0, y0, a0).interpolate(Pose2D(x1, y1, a1), part)

    between = found.lookup("map", "odom", stamp(part).seconds).flat()

    assert between.x == pytest.approx(flat.x, abs=1e-4)
    off = math.remainder(between.yaw - flat.yaw, math.tau)
    assert off == pytest.approx(0.0, abs=0.003)


def test_a_moment_after_the_newest_it_still_counts_and_then_it_is_named() -> None:
    found = tree(link("map", "odom", 1.0))

    assert found.lookup("map", "odom", WALL + 0.5).flat().x == 1.0
    with pytest.raises(NoTransformError, match=r"no map → odom for 2\.1 s") as error:
        found.lookup("map", "odom", WALL + 2.1)
    assert error.value.for_s == pytest.approx(2.1)


NO_TURN = ros.Transform(ros.Vector3(), ros.Quaternion(0.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "bad",
    [
        [link("map", "odom", math.nan)],
        [link("map", "map")],
        [ros.TransformStamped(ros.Header(stamp(), "map"), "odom", NO_TURN)],
        [link("odom", "b"), link("b", "odom")],
    ],
)
def test_what_is_no_transform_is_refused(bad: list[ros.TransformStamped]) -> None:
    found = TransformBuffer()
    found.add(tf(*bad), static=False)

    with pytest.raises(NoTransformError):
        found.lookup("map", "odom", WALL)


def test_as_many_frames_as_somebody_invents_take_no_memory() -> None:
    found = TransformBuffer()

    found.add(tf(*(link("map", f"f{n}") for n in range(300))), static=False)

    assert [found.chain(f"f{n}")[1:] for n in (0, 255, 256)] == [["map"], ["map"], []]
