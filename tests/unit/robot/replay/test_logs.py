import gzip
import json
import logging
import math
from pathlib import Path

import numpy as np
import pytest

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Detection, LaserScan, Odometry
from iveg.robot.replay.logs import LogReader
from tests import data
from tests.data.recorded import ROBOTS, emulated_logs, real_log

DATA = Path(data.__file__).parent
ODOM = '{"t":0,"kind":"odom","x":1,"y":2,"yaw":0.5,"v":0.3,"w":-0.1}'


def written(tmp_path: Path, *lines: str) -> Path:
    file = tmp_path / "log.jsonl"
    file.write_text("\n".join(lines) + "\n", "utf-8")
    return file


def test_a_line_of_odometry_is_pose_and_speeds(tmp_path: Path) -> None:
    (entry,) = LogReader(written(tmp_path, ODOM)).entries()

    assert entry.at == 0.0
    assert isinstance(entry.observation, Odometry)
    assert entry.observation.pose == Pose2D(1.0, 2.0, 0.5)
    assert entry.observation.twist == Twist2D(0.3, -0.1)


def test_the_offset_of_the_sensor_becomes_its_mount(tmp_path: Path) -> None:
    scan = {
        "t": 0.1,
        "kind": "scan",
        "angle_min": -3.0,
        "angle_increment": 2.0,
        "range_min": 0.75,
        "range_max": 130.0,
        "ox": 0.2,
        "oy": -0.1,
        "ranges": [0.5, None, 7],
        "t_src": 1.0,
    }

    _, entry = LogReader(written(tmp_path, ODOM, json.dumps(scan))).entries()

    assert isinstance(entry.observation, LaserScan)
    assert entry.observation.mount == Pose2D(0.2, -0.1, 0.0)
    assert entry.observation.range_min == 0.75
    assert entry.observation.ranges.tolist() == [0.5, math.inf, 7.0]


def test_a_detection_is_a_box_in_the_frame_of_the_map(tmp_path: Path) -> None:
    line = '{"t":1,"kind":"detection","class":"farmer","probability":0.9,"x":5,"y":1}'

    _, entry = LogReader(written(tmp_path, ODOM, line)).entries()

    assert isinstance(entry.observation, Detection)
    assert entry.observation.frame_id == "map"
    assert entry.observation.box.centre[:2] == (5.0, 1.0)


def test_gzipped_and_plain_logs_read_the_same(tmp_path: Path) -> None:
    plain = written(tmp_path, ODOM, ODOM)
    packed = tmp_path / "log.jsonl.gz"
    packed.write_bytes(gzip.compress(plain.read_bytes()))

    one, other = list(LogReader(plain).entries()), list(LogReader(packed).entries())

    assert one == other
    assert len(one) == 2


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("{broken", "not_json"),
        ('{"t":1,"kind":"odom","x":1,"y":2}', "yaw"),
        ('{"t":1,"kind":"odom","x":"1","y":2,"yaw":0}', "x"),
        ('{"t":1,"kind":"odom","x":NaN,"y":2,"yaw":0}', "not_json"),
        ('{"t":-1,"kind":"odom","x":1,"y":2,"yaw":0}', "t"),
        ('{"t":1,"kind":"smell"}', "smell"),
        ("[]", "dict"),
        (
            '{"t":1,"kind":"detection","class":"a=b","probability":1,"x":0,"y":0}',
            "bad_class",
        ),
    ],
)
def test_a_bad_line_is_skipped_and_reported_once_with_file_and_number(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, line: str, why: str
) -> None:
    file = written(tmp_path, ODOM, line, ODOM)
    reader = LogReader(file)

    with caplog.at_level(logging.WARNING):
        twice = [*reader.entries(), *reader.entries()]

    assert len(twice) == 4
    (record,) = caplog.records
    assert f"{file}, line 2 skipped" in record.getMessage()
    assert why in record.getMessage()


def test_an_endless_line_is_one_bad_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    endless = '{"t":1,"kind":"scan","ranges":[' + "1," * 1_500_000

    entries = list(LogReader(written(tmp_path, ODOM, endless, ODOM)).entries())

    assert len(entries) == 2
    (record,) = caplog.records
    assert "line 2 skipped: too_long" in record.getMessage()


def test_empty_lines_are_nothing_to_report(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    entries = list(LogReader(written(tmp_path, ODOM, "", ODOM)).entries())

    assert len(entries) == 2
    assert caplog.records == []


@pytest.mark.parametrize("name", ["missing.jsonl", "missing.jsonl.gz"])
def test_a_file_that_is_not_there_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(DataFileError, match=rf"{name}: cannot be read"):
        next(LogReader(tmp_path / name).entries())


def test_a_file_that_only_looks_gzipped_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "log.jsonl.gz"
    file.write_text(ODOM, "utf-8")

    with pytest.raises(DataFileError, match="cannot be read"):
        next(LogReader(file).entries())


def test_a_file_cut_short_is_refused_when_its_end_is_reached(tmp_path: Path) -> None:
    lines = "\n".join(ODOM.replace('"x":1', f'"x":{n}') for n in range(5_000))
    file = tmp_path / "log.jsonl.gz"
    file.write_bytes(gzip.compress(lines.encode())[:-200])

    with pytest.raises(DataFileError, match="cannot be read"):
        list(LogReader(file).entries())


def test_the_synthetic_log_of_these_tests_is_clean(
    caplog: pytest.LogCaptureFixture,
) -> None:
    entries = list(LogReader(DATA / "aisle.jsonl").entries())

    assert len(entries) == 60
    assert caplog.records == []


@pytest.fixture
def robots_log(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The emulator's recording of a robot, or a real one by its name."""
    if request.param in ROBOTS:
        return emulated_logs(tmp_path)[ROBOTS.index(request.param)]
    return real_log(request.param)


@pytest.mark.parametrize(
    ("robots_log", "beams", "lines"),
    [
        ("AGI", 720, 100),
        ("AGII", 720, 100),
        ("orchard_d1", 897, 1_000),
        ("orchard_d2", 897, 1_000),
        ("orchard_d3", 897, 1_000),
    ],
    indirect=["robots_log"],
)
def test_the_log_of_a_robot_reads_without_a_complaint(
    robots_log: Path, beams: int, lines: int, caplog: pytest.LogCaptureFixture
) -> None:
    entries = list(LogReader(robots_log).entries())
    scans = [e.observation for e in entries if isinstance(e.observation, LaserScan)]

    assert caplog.records == []
    assert len(scans) * 2 == len(entries) >= lines
    assert {scan.ranges.size for scan in scans} == {beams}
    assert np.isfinite(scans[0].ranges).any()
