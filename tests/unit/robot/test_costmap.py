"""The fleet's picture on a robot: what peers met, who is near, and never itself."""

import math
from dataclasses import replace

import numpy as np
import orjson
import pytest

from iveg.domain.costmap import InflatedGrid
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.laser import Outline
from iveg.domain.peer_scan import peer_scan_of
from iveg.ngsi import codec
from iveg.robot.costmap import FleetCostmap
from iveg.robot.peer_alerts import Neighbour
from tests.builders import START, origin, scan

ROOM = Rectangle(0, 0, 20, 20)
BODY = Outline(2.0, 1.2)
HERE, PEER = Pose2D(4.0, 10.0, 0.0), Pose2D(10.0, 10.0, 0.0)
PERSON = Neighbour("person", "farmer", 15.0, 15.0, 0.35, 2.0)
TOPIC = "/AGII/iveg/peer_scan"


def payload(
    distance: float = 3.0, seq: int = 1, *, boot: str = "c", after: float = 0.0
) -> bytes:
    """A peer at ``PEER`` meets something all round."""
    one = scan(
        "AGII",
        [distance] * 720,
        angle_min=-math.pi,
        angle_increment=math.tau / 720,
        range_max=12.0,
    )
    told = peer_scan_of(one, PEER, 0.1)
    return codec.write_peer_scan(
        replace(told, origin=origin(seq, boot=boot, after=after))
    )


def costmap() -> FleetCostmap:
    return FleetCostmap("AGI", BODY, ROOM)


def hear(one: FleetCostmap, said: bytes, own: Pose2D = HERE) -> None:
    one.receive(TOPIC, said, own, START.wall)


def drawn(
    one: FleetCostmap, *near: Neighbour, own: Pose2D = HERE, now: float = 0.0
) -> InflatedGrid:
    return one.draw(one.drain_scans(), near, own, now)


def at(found: InflatedGrid, x: float, y: float) -> int:
    return int(found.data[found.grid.index(x, y)])


def test_a_body_is_lethal_and_its_ring_is_dear_towards_the_centre() -> None:
    found = drawn(costmap(), PERSON)

    assert at(found, 15.0, 15.0) == at(found, 15.3, 15.0) == 100
    assert 50 <= at(found, 16.8, 15.0) < at(found, 15.7, 15.0) < 100
    assert at(found, 17.2, 15.0) == -1


def test_its_own_footprint_is_never_an_obstacle() -> None:
    own = Pose2D(13.0, 10.0, 0.5)
    one = costmap()
    hear(one, payload(), own)
    near = Neighbour("robot", "AGIII", 13.4, 10.0, 0.75, 2.0)
    found = drawn(one, near, own=own)

    for along in np.linspace(-0.99, 0.99, 30):
        for across in np.linspace(-0.59, 0.59, 20):
            place = own.compose(Pose2D(float(along), float(across), 0.0))
            assert at(found, place.x, place.y) == -1


def test_a_peer_that_sees_this_robot_leaves_no_trail_of_it() -> None:
    own = Pose2D(13.8, 10.0, 0.0)
    one = costmap()
    hear(one, payload(), own)
    found = drawn(one, own=HERE)

    assert at(found, 12.95, 10.05) == -1
    assert at(found, 9.95, 12.95) == 100


def test_the_newest_of_a_peer_wins_and_an_older_one_is_dropped() -> None:
    one = costmap()
    hear(one, payload(5.0, seq=3), HERE)
    hear(one, payload(3.0, seq=2), HERE)

    assert at(drawn(one), 12.95, 10.05) == 0

    hear(one, payload(3.0, seq=1, boot="d"), HERE)

    assert at(drawn(one), 12.95, 10.05) > 0


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        (payload(after=5.0), "from_the_future"),
        (payload(after=-5.0), "too_old"),
        (payload().replace(b'"map"', b'"odom"'), "not_a_peer_scan"),
        (payload().replace(b'"x":0.0', b'"x":9.0', 1), "not_a_peer_scan"),
        (payload() + b" " * 1024, "too_large"),
        (orjson.dumps({**orjson.loads(payload()), "stamp": None}), "no_stamp"),
    ],
)
def test_a_bad_scan_is_ignored_and_logged_once(
    said: bytes, reason: str, caplog: pytest.LogCaptureFixture
) -> None:
    one = costmap()
    hear(one, said, HERE)
    hear(one, said, HERE)

    assert [reason in one for one in caplog.messages] == [True]
    assert (drawn(one).data == -1).all()

    hear(one, payload(), HERE)
    assert at(drawn(one), 12.95, 10.05) == 100


def test_a_clock_of_iveg_that_is_set_is_followed() -> None:
    one = costmap()
    one.receive(TOPIC, payload(after=900.0), HERE, START.wall + 900)

    assert len(one.drain_scans()) == 1
