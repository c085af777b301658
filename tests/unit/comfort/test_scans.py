"""Scans that are refused."""

from typing import Any

import orjson

from iveg.domain.observations import Received
from iveg.ngsi import codec
from tests.builders import odometry, scan
from tests.unit.vital.desk import Desk


def measure(**changes: Any) -> bytes:
    """A scan on the wire, with other values where they are given."""
    return orjson.dumps({**orjson.loads(codec.write_measure(scan())), **changes})


def hear(desk: Desk, payload: bytes) -> list[str]:
    """A scan of AGI as it comes from MQTT; reasons of what is refused at once."""
    reading = codec.read_measure("AGI_lidar2D", payload, lambda *_: False)
    received = [Received(one, desk.clock()) for one in reading.observations]
    desk.loop.step(received, desk.clock())
    return [one.reason for one in reading.problems]


def test_f60_a_scan_that_cannot_be_read_is_refused_and_all_else_is_taken() -> None:
    desk = Desk()
    reasons = hear(desk, measure(lidar_points=["near", "far"]))
    desk.hear(odometry("AGII"))

    assert reasons == ["bad_lidar_points"]
    assert desk.world.robot("AGI").scan is None
    assert desk.world.robot("AGII").odometry is not None


def test_a_scan_whose_identity_cannot_be_read_is_refused_at_once() -> None:
    header = {"angle_min": 0.0, "angle_increment": 0.1, "range_max": 9.0, "seq": -1}

    assert hear(Desk(), measure(lidar_header=header)) == ["bad_lidar_points"]


def test_a_scan_without_a_place_is_refused_at_once() -> None:
    header = {"frame_id": "unplaced"}

    assert hear(Desk(), measure(lidar_header=header)) == ["unplaced"]
