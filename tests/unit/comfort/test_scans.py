"""Scans are read where they are drawn, once each, and refused there."""

from typing import Any

import orjson

from iveg.domain.observations import LaserScan, Received, UnreadScan
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


def newest(desk: Desk) -> LaserScan | None:
    return desk.parts.scans.newest(desk.world.robot("AGI"))


def test_a_scan_is_read_when_it_is_drawn_and_once() -> None:
    desk = Desk()
    hear(desk, measure())
    first, second = newest(desk), newest(desk)

    assert isinstance(desk.world.robot("AGI").scan, UnreadScan)
    assert first is not None
    assert first is second
    assert first.ranges.tolist() == scan().ranges.tolist()
    assert first.origin == scan().origin


def test_f60_a_scan_that_cannot_be_read_is_refused_by_those_who_draw_it() -> None:
    desk = Desk()
    at_once = hear(desk, measure(lidar_points=["near", "far"]))
    desk.hear(odometry("AGII"))
    shown = newest(desk), newest(desk)

    assert at_once == []
    assert shown == (None, None)
    assert desk.ingest.counters["rejected.bad_lidar_points"] == 1
    rejected = [
        line.slots for line in desk.event_log.lines if line.key == "log.rejected"
    ]
    assert rejected == [{"source": "AGI", "reason": "bad_lidar_points"}]


def test_a_scan_whose_identity_cannot_be_read_is_refused_at_once() -> None:
    header = {"angle_min": 0.0, "angle_increment": 0.1, "range_max": 9.0, "seq": -1}

    assert hear(Desk(), measure(lidar_header=header)) == ["bad_lidar_points"]


def test_a_scan_without_a_place_is_refused_at_once() -> None:
    header = {"frame_id": "unplaced"}

    assert hear(Desk(), measure(lidar_header=header)) == ["unplaced"]
