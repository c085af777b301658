"""``/{robot}/iveg/peer_scan`` on the wire: small, and refused where it is wrong."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import orjson
import pytest

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.peer_scan import PeerScan, peer_scan_of
from iveg.ngsi import codec
from iveg.ngsi.codec.feedback import LARGEST
from tests.builders import origin, scan

ROUND = scan(
    ranges=[2.0 + n % 7 for n in range(720)],
    angle_min=-math.pi,
    angle_increment=math.tau / 720,
)
TOLD = replace(peer_scan_of(ROUND, Pose2D(1.0, 2.0, 0.3), 0.12), origin=origin(7))


def sent(**changes: Any) -> bytes:
    said = orjson.loads(codec.write_peer_scan(TOLD))
    for key, value in changes.items():
        inside = isinstance(value, dict) and isinstance(said.get(key), dict)
        said[key] = said[key] | value if inside else value
    return orjson.dumps(said)


def test_what_is_written_is_read_back() -> None:
    found = codec.read_peer_scan("AGI", codec.write_peer_scan(TOLD))

    assert (found.robot_id, found.pose, found.mount) == ("AGI", TOLD.pose, TOLD.mount)
    assert (found.age_s, found.range_max, found.origin.seq) == (0.12, 25.0, 7)
    assert np.array_equal(found.ranges, TOLD.ranges)
    assert np.array_equal(found.places, TOLD.places)


def test_the_largest_message_fits_into_a_kibibyte() -> None:
    far = Pose2D(-999_999.1234, -999_999.1234, -3.14159265)
    whole = origin(2**53, boot="b" * 64)
    most = PeerScan(
        "R" * 64,
        whole,
        far,
        1.999,
        Pose2D(-4.9999, -4.9999, -3.1416),
        100.0,
        np.full(72, 99.99, np.float32),
        np.full(72, 9, np.uint8),
    )

    assert len(codec.write_peer_scan(most)) <= LARGEST


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"mount": {"x": 40.0}}, "not_a_peer_scan"),
        ({"robot_pose": None}, "not_a_peer_scan"),
        ({"robot_pose": {"frame_id": "odom"}}, "not_a_peer_scan"),
        ({"age_s": -0.5}, "not_a_peer_scan"),
        ({"age_s": 3.0}, "not_a_peer_scan"),
        ({"ranges": [1.0] * 71}, "not_a_peer_scan"),
        ({"ranges": ["1"] * 72}, "not_a_peer_scan"),
        ({"places": [10] * 72}, "not_a_peer_scan"),
        ({"robot_id": "AGII"}, "another_robot"),
        ({"padding": "x" * 1024}, "too_large"),
    ],
)
def test_what_is_wrong_is_refused(changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(UnreadableError) as refused:
        codec.read_peer_scan("AGI", sent(**changes))

    assert refused.value.reason == reason
