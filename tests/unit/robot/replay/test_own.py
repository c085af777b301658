"""Recordings of iVeg's own, played back as runs of robots."""

from pathlib import Path

import pytest

from iveg.adapters.recordings.incoming import NOTIFICATIONS
from iveg.adapters.recordings.mcap_file import Channel, McapFile
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import DetectionFrame, LaserScan, Odometry
from iveg.ngsi import codec
from iveg.robot.replay.logs import RecordingEntry
from iveg.robot.replay.recordings import open_recording
from tests.builders import (
    START,
    at,
    detection,
    detection_frame,
    notification,
    odometry,
    origin,
    pose_value,
    scan,
)

MOUNT = Pose2D(0.0, 0.0, 0.0)


def measure(topic: str) -> Channel:
    return Channel(topic, "iveg.Measure")


ODOM = measure("/iveg/AGI_odom/attrs")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "2026-11-24T08-00-00Z.mcap"


def entries(path: Path) -> list[RecordingEntry]:
    return list(open_recording(path, MOUNT)())


def pose(x: float, seq: int, robot_id: str = "AGI") -> bytes:
    return codec.write_odometry(odometry(robot_id, x, origin=origin(seq)))


def test_a_robot_is_played_from_either_transport_and_each_message_once(
    path: Path,
) -> None:
    file = McapFile(path, START)
    copy = notification({"base_pose_ground_truth": pose_value(x=1.0, seq=1)})
    file.add(NOTIFICATIONS, at(1.0), copy)
    file.add(ODOM, at(1.1), pose(1.0, 1))
    file.add(measure("/AGI/iveg/odom"), at(1.2), pose(2.0, 2))
    file.add(ODOM, at(1.3), pose(2.0, 2))
    seen = detection_frame("AGI", detection(x=3.0), origin=origin(1))
    boxes = measure("/iveg/AGI_yolox_bounding_boxes/attrs")
    file.add(boxes, at(1.4), codec.write_detections(seen))
    swept = measure("/iveg/AGI_lidar2D/attrs")
    file.add(swept, at(1.5), codec.write_scan(scan(origin=origin(1))))
    file.add(ODOM, at(1.6), b"no JSON")
    file.finish()

    found = entries(path)
    kinds = [type(one.observation) for one in found]
    assert kinds == [Odometry, Odometry, DetectionFrame, LaserScan]
    assert [round(one.at, 6) for one in found] == [0.0, 0.2, 0.4, 0.5]
    xs = [one.observation.pose.x for one in found[:2]]  # type: ignore[union-attr]
    assert xs == [1.0, 2.0]


def test_of_several_robots_one_is_named(path: Path) -> None:
    file = McapFile(path, START)
    for n, robot_id in enumerate(("AGI", "AGII")):
        topic = measure(f"/iveg/{robot_id}_odom/attrs")
        file.add(topic, at(n), pose(n, 1, robot_id))
    file.finish()

    with pytest.raises(DataFileError, match=r"holds AGI, AGII: name one"):
        entries(path)
    (only,) = entries(path.with_name(path.name + "#AGII"))
    assert only.observation.robot_id == "AGII"  # type: ignore[union-attr]
    with pytest.raises(DataFileError, match="no odometry"):
        entries(path.with_name(path.name + "#D1"))


def test_what_this_iveg_cannot_read_is_told_as_that(path: Path) -> None:
    file = McapFile(path, START)
    file.add(ODOM, at(0.0), b'{"in_a_newer_format": 1}')
    file.finish()
    with pytest.raises(DataFileError, match="nothing of a robot that this iVeg can"):
        entries(path)

    magic = bytearray(path.read_bytes())
    magic[5] = ord("9")
    path.write_bytes(magic)
    with pytest.raises(DataFileError, match="no recording of iVeg's that can be read"):
        entries(path.with_name(path.name + "#AGI"))


def test_one_that_breaks_off_says_so_after_what_can_be_read(path: Path) -> None:
    file = McapFile(path, START)
    file.add(ODOM, at(0.0), pose(1.0, 1))
    file.settle()
    file.abandon()

    entries_left = open_recording(path, MOUNT)()
    assert isinstance(next(entries_left).observation, Odometry)
    with pytest.raises(DataFileError, match="breaks off"):
        next(entries_left)
