"""Robots as each other's ground truth: the error of places, and what makes a bias."""

import math

import pytest

from iveg.domain.camera_bias import PeerLooks, peer_error
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import Instant

NORTH = math.pi / 2


def at(moment: float) -> Instant:
    return Instant(moment, 1_700_000_000.0 + moment)


@pytest.mark.parametrize(
    ("seen", "yaw", "expected"),
    [
        ((5.0, 0.0), 0.0, (0.0, 0.0)),
        ((5.0, 0.4), 0.0, (0.0, 0.4)),
        ((5.3, 0.0), 0.0, (0.3, 0.0)),
        # Nearer by no more than half of the peer: the box ends at its near side.
        ((4.5, 0.0), 0.0, (0.0, 0.0)),
        ((4.2, 0.0), 0.0, (-0.3, 0.0)),
        # A robot that looks north has east on its right, farther behind it or not.
        ((5.0, 0.4), NORTH, (0.4, 0.0)),
        ((5.3, 0.0), NORTH, (0.0, -0.3)),
    ],
)
def test_an_error_is_told_in_the_frame_of_the_robot_that_looks(
    seen: tuple[float, float], yaw: float, expected: tuple[float, float]
) -> None:
    error = peer_error(seen, Pose2D(0.0, 0.0, yaw), Pose2D(5.0, 0.0, 2.0), 0.5)

    assert error == pytest.approx(expected, abs=1e-9)


def test_a_mount_that_is_turned_is_off_by_its_angle_at_any_place() -> None:
    """0.1 rad at 5 m are half a metre to the left, wherever robot and peer stand."""
    for yaw in (0.0, 1.0, -2.0):
        pose = Pose2D(3.0, -4.0, yaw)
        peer = Pose2D(*pose.transform(5.0, 0.0), 0.0)
        seen = pose.transform(5.0 * math.cos(0.1), 5.0 * math.sin(0.1))

        _, left = peer_error(seen, pose, peer, 0.5)

        assert left == pytest.approx(5.0 * math.sin(0.1))


def test_ten_looks_make_a_bias_and_one_wrong_one_does_not_change_it() -> None:
    looks = PeerLooks()
    for number in range(9):
        looks.note(float(number), (0.1, 0.3))
    assert looks.bias(at(9.0)) is None

    looks.note(9.0, (-4.0, 7.0))

    bias = looks.bias(at(9.5))
    assert bias is not None
    assert (bias.ahead_m, bias.left_m, bias.looks) == (0.1, 0.3, 10)
    assert bias.off_m == pytest.approx(math.hypot(0.1, 0.3))
    assert bias.last_at == 9.0


def test_pictures_of_one_moment_are_one_look_and_old_ones_none() -> None:
    looks = PeerLooks()
    for number in range(50):
        looks.note(number / 30.0, (0.0, 0.5))
    assert looks.bias(at(2.0)) is None

    for number in range(10, 20):
        looks.note(float(number), (0.0, 0.5))
    assert looks.bias(at(20.0)) is not None
    assert looks.bias(at(615.0)) is None
