"""What peers are told of a scan: short, exact where it met something, never bolder."""

import math

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import LaserScan
from iveg.domain.peer_scan import BEAMS, PeerScan, peer_scan_of
from tests.builders import scan

HERE = Pose2D(3.0, 4.0, 0.7)


def all_round(ranges: list[float], *, clockwise: bool = False) -> LaserScan:
    step = math.tau / len(ranges)
    return scan(
        ranges=ranges,
        angle_min=math.pi if clockwise else -math.pi,
        angle_increment=-step if clockwise else step,
        range_max=12.0,
        mount=Pose2D(0.4, 0.1, -0.2),
    )


def told(one: LaserScan) -> PeerScan:
    return peer_scan_of(one, HERE, 0.1)


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("rays", [40, 72, 360, 720, 1081, 4096])
def test_a_thing_stays_where_the_laser_met_it(rays: int, *, clockwise: bool) -> None:
    ranges = [math.inf] * rays
    ranges[rays // 3] = 5.0
    one = all_round(ranges, clockwise=clockwise)

    found = told(one).returns()

    (true,) = one.points(HERE)
    nearest = np.hypot(*(found - true).T)
    assert nearest.min() <= 0.05 + 5.0 * math.tau / rays / 2 * (rays < BEAMS)


def test_a_beam_is_as_long_as_its_shortest_ray() -> None:
    ranges = [9.0] * 720
    ranges[33] = 2.0

    found = told(all_round(ranges)).ranges

    assert found[3] == pytest.approx(2.0, abs=0.011)
    assert np.delete(found, [2, 3, 4]).min() == pytest.approx(9.0, abs=0.011)


@pytest.mark.parametrize("nothing", [0.05, 0.0, math.nan, -math.inf])
def test_a_beam_with_a_ray_that_says_nothing_says_nothing(nothing: float) -> None:
    ranges = [math.inf] * 720
    ranges[33] = nothing

    found = told(all_round(ranges)).ranges

    assert found[3] == 0.0
    assert np.isinf(np.delete(found, [2, 3, 4])).all()
