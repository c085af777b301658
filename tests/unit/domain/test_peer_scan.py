"""What peers are told of a scan: short, exact where it met something, never bolder."""

import math

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import LaserScan
from iveg.domain.peer_scan import BEAMS, peer_scan_of
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


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("rays", [40, 72, 360, 720, 1081, 4096])
def test_a_thing_stays_where_the_laser_met_it(rays: int, *, clockwise: bool) -> None:
    ranges = [math.inf] * rays
    ranges[rays // 3] = 5.0
    one = all_round(ranges, clockwise=clockwise)

    found = peer_scan_of(one, HERE, 0.1).returns()

    (true,) = one.points(HERE)
    nearest = np.hypot(*(found - true).T)
    assert nearest.min() <= 0.05 + 5.0 * math.tau / rays / 2 * (rays < BEAMS)


@pytest.mark.parametrize(
    ("ray", "others", "told_as"),
    [(2.0, 9.0, 2.0), (0.05, math.inf, 0.0), (math.nan, math.inf, 0.0)],
)
def test_a_beam_says_as_little_as_the_ray_of_it_that_says_least(
    ray: float, others: float, told_as: float
) -> None:
    ranges = [others] * 720
    ranges[33] = ray

    found = peer_scan_of(all_round(ranges), HERE, 0.1).ranges

    assert found[3] == pytest.approx(told_as, abs=0.011)
    assert np.delete(found, [2, 3, 4]).min() == pytest.approx(others, abs=0.011)
