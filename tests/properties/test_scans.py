"""Every scan that is read can be drawn, in bounded memory."""

import tracemalloc

import orjson
from hypothesis import given
from hypothesis import strategies as st

from iveg.domain.costmap import Grid, Occupancy, sweep_of
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.observations import LaserScan
from iveg.ngsi import codec

ROOM = Grid.over(Rectangle(0, 0, 20, 10))
MOST_BYTES = 20_000_000

USUAL = {
    "angle_min": -1.5,
    "angle_increment": 0.01,
    "range_min": 0.1,
    "range_max": 12.0,
    "x": 0.2,
    "y": 0.0,
    "yaw": 0.0,
}
wild = st.sampled_from(
    [
        sign * size
        for sign in (1.0, -1.0)
        for size in (0.0, 1e-300, 1e-6, 1e-4, 3.0, 1e4)
    ]
)
headers = st.dictionaries(st.sampled_from(sorted(USUAL)), wild, max_size=2)
lengths = st.sampled_from([0.0, 1e-300, 0.1, 2.0, 12.0, 1e6])
points = st.lists(lengths | st.none(), max_size=50)


@given(headers, points)
def test_a_scan_is_refused_or_can_be_drawn(
    header: dict[str, float], ranges: list[float | None]
) -> None:
    said = {"lidar_points": ranges, "lidar_header": USUAL | header}
    payload = orjson.dumps(said)

    for one in codec.read_measure("AGI_lidar2D", payload).observations:
        assert isinstance(one, LaserScan)
        tracemalloc.start()
        Occupancy(ROOM).add(sweep_of(one, Pose2D(5.0, 5.0, 0.3), ROOM))
        one.points(Pose2D(5.0, 5.0, 0.3))
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert most < MOST_BYTES
