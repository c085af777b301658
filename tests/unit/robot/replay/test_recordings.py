import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import LaserScan, Odometry
from iveg.robot.replay.bags import AS_RECORDED, BagOptions
from iveg.robot.replay.logs import RecordingEntry
from iveg.robot.replay.recordings import open_recording
from tests.data.bags import (
    ODOMETRY,
    SCAN,
    TEXT,
    Said,
    bag_directory,
    db3_bag,
    drive,
    mcap_bag,
    ros1_bag,
)

MOUNT = Pose2D(0.2, 0.0, 0.1)
Write = Callable[[Path, Sequence[Said]], Path]
KINDS = [
    pytest.param(ros1_bag, "log.bag", id="ros1"),
    pytest.param(db3_bag, "run", id="db3"),
    pytest.param(mcap_bag, "run", id="mcap"),
    pytest.param(bag_directory, "run", id="directory"),
]


def entries(path: Path, options: BagOptions = AS_RECORDED) -> list[RecordingEntry]:
    return list(open_recording(path, MOUNT, options)())


def poses(found: Sequence[RecordingEntry]) -> list[Pose2D]:
    return [e.observation.pose for e in found if isinstance(e.observation, Odometry)]


@pytest.mark.parametrize(("write", "name"), KINDS)
def test_a_bag_of_each_kind_gives_odometry_and_scans(
    write: Write, name: str, tmp_path: Path
) -> None:
    said = (
        Said("/odom", ODOMETRY, 500.0, x=1.0, yaw=2.5, v=0.5),
        Said("/chatter", TEXT),
        Said("/scan", SCAN, 500.25, ranges=(1.0, math.inf, math.nan, -1.0, 0.2)),
    )

    odometry, scan = entries(write(tmp_path / name, said))

    assert isinstance(odometry.observation, Odometry)
    assert odometry.at == 0.0
    assert odometry.observation.pose.x == 1.0
    assert odometry.observation.pose.yaw == pytest.approx(2.5)
    assert odometry.observation.twist == Twist2D(0.5, 0.25)
    assert isinstance(scan.observation, LaserScan)
    assert scan.at == pytest.approx(0.25)
    assert scan.observation.mount == MOUNT
    assert (scan.observation.angle_min, scan.observation.range_max) == (-1.5, 20.0)
    assert scan.observation.ranges.tolist() == pytest.approx(
        [1.0, math.inf, 0.0, 0.0, 0.2]
    )


@pytest.mark.parametrize(("write", "name"), KINDS)
def test_a_recording_is_read_from_its_start_as_often_as_asked(
    write: Write, name: str, tmp_path: Path
) -> None:
    recording = open_recording(write(tmp_path / name, drive()), MOUNT)

    first, again = list(recording()), list(recording())

    assert len(first) == 40
    assert poses(first) == poses(again)


def test_the_stamps_of_the_sensors_are_the_time(tmp_path: Path) -> None:
    found = entries(ros1_bag(tmp_path / "log.bag", drive(1.0)))

    assert [e.at for e in found] == pytest.approx([n // 2 / 10 for n in range(20)])


def test_bag_time_is_the_time_where_it_is_asked_for(tmp_path: Path) -> None:
    found = entries(
        ros1_bag(tmp_path / "log.bag", drive(1.0)), BagOptions(bag_time=True)
    )

    assert [e.at for e in found] == pytest.approx([n / 20 for n in range(20)])


def test_bag_time_is_the_time_where_no_stamp_is_filled_in(tmp_path: Path) -> None:
    found = entries(mcap_bag(tmp_path / "run", drive(1.0, stamps=False)))

    assert [e.at for e in found] == pytest.approx([n / 20 for n in range(20)])


def test_a_message_with_an_absurd_stamp_is_left_out(tmp_path: Path) -> None:
    said = drive(1.0)
    said[4] = replace(said[4], stamp_s=2.0e9)

    assert len(entries(db3_bag(tmp_path / "run", said))) == 19


def test_a_bag_without_scans_is_odometry_alone(tmp_path: Path) -> None:
    said = [one for one in drive(1.0) if one.kind == ODOMETRY]

    assert len(poses(entries(db3_bag(tmp_path / "run", said)))) == 10


def test_a_named_topic_is_the_one_that_is_read(tmp_path: Path) -> None:
    said = [Said("/raw", ODOMETRY, 1.0, x=7.0), *drive(1.0)]
    bag = db3_bag(tmp_path / "run", said)

    assert [p.x for p in poses(entries(bag, BagOptions("/raw")))] == [7.0]


@pytest.mark.parametrize(
    ("topics", "why"),
    [
        (
            AS_RECORDED,
            r"--odom-topic must name one of those of nav_msgs\S+: /odom, /raw\.$",
        ),
        (BagOptions("/gone"), r"--odom-topic /gone is not among .*: /odom, /raw\.$"),
        (BagOptions("/raw", "/gone"), r"--scan-topic /gone is not .*: /scan\.$"),
        (BagOptions("/scan"), r"--odom-topic /scan is not among"),
    ],
)
def test_topics_that_leave_open_what_is_meant_are_listed(
    topics: BagOptions, why: str, tmp_path: Path
) -> None:
    said = [Said("/raw", ODOMETRY, 1.0), *drive(0.2)]

    with pytest.raises(DataFileError, match=why):
        entries(mcap_bag(tmp_path / "run", said), topics)


def test_a_bag_without_odometry_is_refused(tmp_path: Path) -> None:
    bag = ros1_bag(tmp_path / "log.bag", [Said("/chatter", TEXT)])

    with pytest.raises(DataFileError, match=r"log\.bag: holds no topic of type nav_m"):
        entries(bag)


SAW = '{"t":1,"kind":"detection","class":"farmer","probability":0.9,"x":5,"y":1}\n'


def test_a_log_without_odometry_is_refused_unless_it_is_said_where_it_stands(
    tmp_path: Path,
) -> None:
    file = tmp_path / "camera.jsonl"
    file.write_text(SAW)

    with pytest.raises(DataFileError, match=r"holds no odometry .*--pose says where"):
        open_recording(file, MOUNT)


def test_a_log_of_a_fixed_camera_stands_where_it_was_said(tmp_path: Path) -> None:
    file = tmp_path / "camera.jsonl"
    file.write_text(SAW)

    pose, saw = open_recording(file, MOUNT, pose=Pose2D(3.0, 4.0, 0.5))()

    assert isinstance(pose.observation, Odometry)
    assert pose.observation.pose == Pose2D(3.0, 4.0, 0.5)
    assert pose.observation.twist == Twist2D(0.0, 0.0)
    assert (pose.at, saw.at) == (1.0, 1.0)


def test_a_bag_of_scans_alone_stands_where_it_was_said(tmp_path: Path) -> None:
    said = [one for one in drive(1.0) if one.kind == SCAN]
    bag = db3_bag(tmp_path / "run", said)

    found = list(open_recording(bag, MOUNT, pose=Pose2D(3.0, 4.0, 0.5))())

    assert poses(found) == [Pose2D(3.0, 4.0, 0.5)]
    assert len(found) == len(said) + 1


def test_what_moves_by_its_own_odometry_is_not_nailed_down(tmp_path: Path) -> None:
    bag = db3_bag(tmp_path / "run", drive(1.0))

    found = open_recording(bag, MOUNT, pose=Pose2D(30.0, 4.0, 0.5))()

    assert max(one.x for one in poses(list(found))) < 3.0


def test_an_empty_log_is_refused_wherever_it_stands(tmp_path: Path) -> None:
    file = tmp_path / "camera.jsonl"
    file.write_text("\n")

    with pytest.raises(DataFileError, match="holds nothing that can be used"):
        open_recording(file, MOUNT, pose=Pose2D(0.0, 0.0, 0.0))


def test_a_message_that_cannot_be_used_is_reported_once_and_skipped(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    said = drive(1.0)
    said[2] = replace(said[2], raw=b"\x00\x01\x00\x00nothing")
    said[4] = replace(said[4], x=math.nan)
    recording = open_recording(db3_bag(tmp_path / "run", said), MOUNT)

    with caplog.at_level(logging.WARNING):
        assert len(poses(list(recording()))) == 8
        assert len(poses(list(recording()))) == 8

    (told,) = caplog.messages
    assert "/odom: unusable messages are skipped" in told


def test_a_bag_whose_odometry_is_all_unusable_is_refused(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    said = [replace(one, x=math.inf) for one in drive(1.0)]

    with pytest.raises(DataFileError, match="holds no odometry that can be used"):
        entries(mcap_bag(tmp_path / "run", said))


@pytest.mark.parametrize("suffix", [".bag", ".db3", ".mcap"])
@pytest.mark.parametrize("content", [b"", b"no bag at all\n" * 20, b"\x00" * 4096])
def test_a_foreign_file_is_refused_with_one_sentence(
    suffix: str, content: bytes, tmp_path: Path
) -> None:
    file = tmp_path / f"log{suffix}"
    file.write_bytes(content)

    with pytest.raises(DataFileError, match=rf"log{suffix}: cannot be read: ") as told:
        entries(file)

    assert "\n" not in str(told.value)


@pytest.mark.parametrize(("write", "name"), KINDS[:3])
@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9])
def test_a_bag_that_was_cut_off_never_ends_in_anything_but_a_sentence(
    write: Write, name: str, kept: float, tmp_path: Path
) -> None:
    file = write(tmp_path / name, drive(20.0))
    whole = file.read_bytes()
    file.write_bytes(whole[: int(len(whole) * kept)])

    with pytest.raises(DataFileError, match=f"{file.name}: cannot be read: "):
        entries(file)


def test_a_directory_that_is_no_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match="cannot be read: "):
        entries(tmp_path)


def test_what_is_no_recording_by_its_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataFileError, match=r"is none of \.jsonl, .*\.bag, and no dir"):
        entries(tmp_path / "notes.txt")
