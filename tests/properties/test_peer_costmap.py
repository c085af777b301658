"""What peers say on a robot's costmap: never bolder than their scans, never a speed."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import orjson
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from iveg.adapters.mqtt import BrokerAddress
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.laser import Outline
from iveg.domain.observations import LaserScan
from iveg.domain.peer_scan import peer_scan_of
from iveg.ngsi import codec
from iveg.robot.costmap import FleetCostmap
from iveg.robot.node import NodeSettings, RobotNode
from tests.builders import AGI, origin, scan

ROOM = Rectangle(-8.0, -8.0, 8.0, 8.0)
BODY = Outline(2.0, 1.2)
FAR_OFF = Pose2D(-7.0, -7.0, 0.0)
TOPIC = "/AGII/iveg/peer_scan"

lengths = st.sampled_from([0.0, 0.05, 0.5, 2.0, 3.7, 6.0, 40.0, math.inf, math.nan])
yaws = st.floats(-math.pi, math.pi)


@st.composite
def scans(draw: st.DrawFn) -> LaserScan:
    """Any laser: some rays or many, all round or not, either way, with gaps."""
    rays = draw(st.sampled_from([5, 60, 72, 100, 181, 360, 719]))
    turn = draw(st.sampled_from([0.5, 2.0, 4.7, 6.1, math.tau]))
    way = draw(st.sampled_from([-1.0, 1.0]))
    runs = draw(st.lists(lengths, min_size=1, max_size=12))
    return scan(
        "AGII",
        np.repeat(runs, math.ceil(rays / len(runs)))[:rays].tolist(),
        angle_min=draw(yaws),
        angle_increment=way * turn / rays,
        range_max=12.0,
        mount=Pose2D(0.3, -0.1, draw(yaws)),
    )


def spoken_for(one: LaserScan, bearing: float, wide: float) -> float:
    """How far the longest ray went that speaks for a bearing of the laser (m).

    Reckoned ray by ray, without anything of the product; 0: none says anything.

    Args:
        one: The scan.
        bearing: Middle of what is asked for (rad).
        wide: Half of its width (rad).
    """
    near = wide + 0.56 * abs(one.angle_increment)
    return max(
        (
            float(length)
            for n, length in enumerate(one.ranges)
            if length >= one.range_min
            and _apart(one.angle_min + n * one.angle_increment, bearing) <= near
        ),
        default=0.0,
    )


def _apart(one: float, other: float) -> float:
    return abs((one - other + math.pi) % math.tau - math.pi)


def hear(one: LaserScan, pose: Pose2D) -> FleetCostmap:
    costmap = FleetCostmap("AGI", BODY, ROOM)
    told = replace(peer_scan_of(one, pose, 0.1), origin=origin())
    costmap.receive(TOPIC, codec.write_peer_scan(told), FAR_OFF, None)
    return costmap


@settings(max_examples=40, deadline=None)
@given(scans(), yaws)
@example(
    # A cell at the laser is wide, and its rays lie close together.
    scan(
        "AGII",
        [0.5, 0.5, 0.0, 0.0, 0.0],
        angle_min=-0.5625,
        angle_increment=0.1,
        range_max=12.0,
        mount=Pose2D(0.3, -0.1, 0.0),
    ),
    1.59375,
)
def test_nothing_is_free_that_the_senders_scan_does_not_say_is_free(
    one: LaserScan, yaw: float
) -> None:
    pose = Pose2D(0.4, -0.3, yaw)
    costmap = hear(one, pose)
    waiting = costmap.drain_scans()
    assert len(waiting) == 1
    found = costmap.draw(waiting, (), FAR_OFF, 0.0)

    laser = pose.compose(one.mount)
    free = np.argwhere(found.data == 0)
    for row, column in free[:: max(1, len(free) // 60)]:
        x = found.grid.xmin + (column + 0.5) * found.grid.resolution
        y = found.grid.ymin + (row + 0.5) * found.grid.resolution
        far = math.hypot(x - laser.x, y - laser.y)
        # The cell, and a place of the laser that is known to a quarter of a cell.
        wide = math.atan2(0.1, max(far - 0.1, 0.01))
        bearing = math.atan2(y - laser.y, x - laser.x) - laser.yaw
        assert spoken_for(one, bearing, wide) >= far - 0.1


@pytest.fixture(scope="module")
def node(tmp_path_factory: pytest.TempPathFactory) -> RobotNode:
    folder: Path = tmp_path_factory.mktemp("node")
    settings_ = NodeSettings(
        address=BrokerAddress("127.0.0.1", 1), apikey="iveg", directory=folder
    )
    return RobotNode("AGI", settings_, profile=AGI, drive=lambda _: None)


numbers = st.floats() | st.integers(-(2**63), 2**63) | st.none() | st.text(max_size=5)
anything = numbers | st.lists(numbers, min_size=70, max_size=73)
true = orjson.loads(
    codec.write_peer_scan(
        replace(peer_scan_of(scan("AGII"), FAR_OFF, 0.1), origin=origin())
    )
)
changes = st.dictionaries(
    st.sampled_from([*true, "speed_limits", "alerts"]),
    anything | st.dictionaries(st.sampled_from(["x", "y", "yaw"]), numbers),
    max_size=4,
)
payloads_ = st.lists(
    st.binary(max_size=1200)
    | changes.map(lambda one: json.dumps({**true, **one}).encode()),
    max_size=5,
)


@settings(max_examples=60, deadline=None)
@given(payloads_)
def test_whatever_a_peers_scan_says_no_factor_changes(
    node: RobotNode, payloads: list[bytes]
) -> None:
    costmap = FleetCostmap("AGI", BODY, ROOM)
    node.on_peer_scan(lambda topic, scan: costmap.receive(topic, scan, FAR_OFF, None))
    machine = node.machine
    before = machine.cap, machine.state(0.0), machine.holds

    for payload in payloads:
        node._on_message(TOPIC, payload)
    drawn = costmap.draw(costmap.drain_scans(), (), FAR_OFF, 0.0)

    assert (machine.cap, machine.state(0.0), machine.holds) == before
    assert drawn.data.min() >= -1
    assert drawn.data.max() <= 100
