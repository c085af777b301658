"""Recorded runs as files: JSON lines, and iVeg's own."""

import gzip
import math
import os
from pathlib import Path

import numpy as np
import pytest

from iveg.adapters.recordings.mcap_file import NOTIFICATIONS, Channel, McapFile
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import DetectionFrame, LaserScan, Odometry
from iveg.ngsi import codec
from iveg.robot.replay.logs import LogReader, RecordingEntry
from iveg.robot.replay.replay import open_recording
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
from tests.processes import ROOT

# --- logs -------------------------------------------------------------------------

ODOM = '{"t":0,"kind":"odom","x":1,"y":2,"yaw":0.5,"v":0.3,"w":-0.1}'


def written(tmp_path: Path, *lines: str) -> Path:
    file = tmp_path / "log.jsonl"
    file.write_text("\n".join(lines) + "\n", "utf-8")
    return file


def test_the_offset_of_the_sensor_becomes_its_mount(tmp_path: Path) -> None:
    scan = (
        '{"t":0.1,"kind":"scan","angle_min":-3,"angle_increment":2,"range_min":0.75,'
        '"range_max":130,"ox":0.2,"oy":-0.1,"ranges":[0.5,null,7],"t_src":1}'
    )

    _, entry = LogReader(written(tmp_path, ODOM, scan)).entries()

    assert isinstance(entry.observation, LaserScan)
    assert entry.observation.mount == Pose2D(0.2, -0.1, 0.0)
    assert entry.observation.range_min == 0.75
    assert entry.observation.ranges.tolist() == [0.5, math.inf, 7.0]


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("{broken", "not_json"),
        ('{"t":1,"kind":"odom","x":1,"y":2}', "yaw"),
        ('{"t":1,"kind":"odom","x":NaN,"y":2,"yaw":0}', "not_json"),
        ('{"t":1,"kind":"smell"}', "smell"),
    ],
)
def test_a_bad_line_is_skipped_and_reported_once_with_file_and_number(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, line: str, why: str
) -> None:
    file = written(tmp_path, ODOM, line, ODOM)
    reader = LogReader(file)

    assert len([*reader.entries(), *reader.entries()]) == 4
    (record,) = caplog.records
    assert f"{file}, line 2 skipped" in record.getMessage()
    assert why in record.getMessage()


SAW = '{"t":%s,"kind":"detection","class":"farmer","probability":0.9,"x":%s,"y":1}'


def test_detections_of_a_moment_are_one_frame_and_then_odometry_is_an_empty_one(
    tmp_path: Path,
) -> None:
    later = (ODOM.replace('"t":0', f'"t":{at}') for at in (1.2, 2.0))
    saw = SAW % (1.0, 4), SAW % (1.01, 6), SAW % (1.1, 5)

    found = LogReader(written(tmp_path, ODOM, *saw, *later)).entries()

    frames = [one.observation for one in found]
    xs = [
        [seen.box.centre[0] for seen in frame.detections]
        for frame in frames
        if isinstance(frame, DetectionFrame)
    ]
    assert xs == [[4.0], [4.0, 6.0], [5.0], []]


MANY = "\n".join(ODOM.replace('"x":1', f'"x":{n}') for n in range(5_000)).encode()


@pytest.mark.parametrize("content", [None, ODOM.encode(), gzip.compress(MANY)[:-200]])
def test_a_file_that_is_missing_not_gzipped_or_cut_short_is_refused(
    content: bytes | None, tmp_path: Path
) -> None:
    file = tmp_path / "log.jsonl.gz"
    if content is not None:
        file.write_bytes(content)

    with pytest.raises(DataFileError, match=r"log\.jsonl\.gz: cannot be read"):
        list(LogReader(file).entries())


REAL = Path(os.environ.get("IVEG_TEST_RECORDINGS", ROOT / "../shared/data"))


@pytest.mark.parametrize("name", ["orchard_d1", "orchard_d3"])
def test_the_log_of_a_real_robot_reads_without_a_complaint(
    name: str, caplog: pytest.LogCaptureFixture
) -> None:
    file = REAL / f"{name}.jsonl.gz"
    if not file.exists():
        pytest.skip(f"no {file.name} in {REAL}; IVEG_TEST_RECORDINGS says where it is")
    entries = list(LogReader(file).entries())
    scans = [e.observation for e in entries if isinstance(e.observation, LaserScan)]

    assert caplog.records == []
    assert len(scans) * 2 == len(entries) >= 1_000
    assert {scan.ranges.size for scan in scans} == {897}
    assert np.isfinite(scans[0].ranges).any()


# --- own --------------------------------------------------------------------------

MOUNT = Pose2D(0.0, 0.0, 0.0)


def measure(topic: str) -> Channel:
    return Channel(topic, "iveg.Measure")


OWN_ODOM = measure("/iveg/AGI_odom/attrs")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "2026-11-24T08-00-00Z.mcap"


def entries(path: Path) -> list[RecordingEntry]:
    return list(open_recording(path, MOUNT)())


def pose(x: float, seq: int, robot_id: str = "AGI") -> bytes:
    return codec.write_measure(odometry(robot_id, x, origin=origin(seq)))


def test_a_robot_is_played_from_either_transport_and_each_message_once(
    path: Path,
) -> None:
    file = McapFile(path, START)
    copy = notification({"base_pose_ground_truth": pose_value(x=1.0, seq=1)})
    file.add(NOTIFICATIONS, at(1.0), copy)
    file.add(OWN_ODOM, at(1.1), pose(1.0, 1))
    file.add(measure("/AGI/iveg/odom"), at(1.2), pose(2.0, 2))
    file.add(OWN_ODOM, at(1.3), pose(2.0, 2))
    seen = detection_frame("AGI", detection(x=3.0), origin=origin(1))
    boxes = measure("/iveg/AGI_yolox_bounding_boxes/attrs")
    file.add(boxes, at(1.4), codec.write_measure(seen))
    swept = measure("/iveg/AGI_lidar2D/attrs")
    file.add(swept, at(1.5), codec.write_measure(scan(origin=origin(1))))
    file.add(OWN_ODOM, at(1.6), b"no JSON")
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
    assert only.observation.robot_id == "AGII"
    with pytest.raises(DataFileError, match="no odometry"):
        entries(path.with_name(path.name + "#D1"))


def test_what_this_iveg_cannot_read_is_told_as_that(path: Path) -> None:
    file = McapFile(path, START)
    file.add(OWN_ODOM, at(0.0), b'{"in_a_newer_format": 1}')
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
    file.add(OWN_ODOM, at(0.0), pose(1.0, 1))
    file.flush()
    left = path.read_bytes()
    file.finish()
    path.write_bytes(left)

    entries_left = open_recording(path, MOUNT)()
    assert isinstance(next(entries_left).observation, Odometry)
    with pytest.raises(DataFileError, match="breaks off"):
        next(entries_left)
