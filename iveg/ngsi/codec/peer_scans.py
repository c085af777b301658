"""Scans that iVeg hands on to robots which ask for them, both ways."""

import numpy as np
import orjson
from pydantic import ValidationError

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Pose2D
from iveg.domain.peer_scan import PeerScan
from iveg.ngsi import peer_payloads
from iveg.ngsi.codec.fields import read_origin, rounded
from iveg.ngsi.codec.untrusted import first_complaint, load_json

LARGEST = 1024
"""Size of a message at most (bytes)."""


def write_peer_scan(scan: PeerScan) -> bytes:
    """The bytes of ``/{robot}/iveg/peer_scan``."""
    centimetres = scan.ranges.astype(np.float64).round(2).tolist()
    return orjson.dumps(
        {
            "boot": scan.origin.boot,
            "seq": scan.origin.seq,
            "stamp": scan.origin.stamp,
            "robot_id": scan.robot_id,
            "robot_pose": {**_pose(scan.pose), "frame_id": "map"},
            "age_s": round(scan.age_s, 3),
            "mount": _pose(scan.mount),
            "range_max": round(scan.range_max, 3),
            "ranges": [None if one == np.inf else one for one in centimetres],
            "places": scan.places.tolist(),
        }
    )


def _pose(pose: Pose2D) -> dict[str, float | None]:
    return {"x": rounded(pose.x), "y": rounded(pose.y), "yaw": rounded(pose.yaw)}


def read_peer_scan(robot_id: str, payload: bytes) -> PeerScan:
    """Read ``/{robot}/iveg/peer_scan``.

    Raises:
        UnreadableError: ``too_large``, ``not_json``, ``not_a_peer_scan``, or
            ``another_robot`` than ``robot_id``.
    """
    if len(payload) > LARGEST:
        raise UnreadableError("too_large", f"{len(payload)} bytes")
    try:
        value = peer_payloads.PeerScanValue.model_validate(load_json(payload))
    except ValidationError as error:
        raise UnreadableError("not_a_peer_scan", first_complaint(error)) from error
    if value.robot_id != robot_id:
        raise UnreadableError("another_robot", value.robot_id)
    pose, mount = value.robot_pose, value.mount
    ranges = np.array([np.inf if r is None else r for r in value.ranges], np.float32)
    return PeerScan(
        robot_id,
        read_origin(value),
        Pose2D(pose.x, pose.y, pose.yaw),
        value.age_s,
        Pose2D(mount.x, mount.y, mount.yaw),
        value.range_max,
        ranges,
        np.array(value.places, np.uint8),
    )
