"""Recordings of any format, and their playback."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Odometry,
    Origin,
)
from iveg.robot.replay.bags import NamedTopics
from iveg.robot.replay.logs import RecordingEntry
from iveg.robot.replay.replay import AS_RECORDED, Playback, open_recording
from tests.data.bags import (
    ODOMETRY,
    SCAN,
    TEXT,
    Said,
    bag_directory,
    db3_bag,
    drive,
    mcap_bag,
)

# --- playback ---------------------------------------------------------------------


def moved(at: float, x: float, yaw: float = 0.0, v: float = 1.0) -> RecordingEntry:
    pose, twist = Pose2D(x, 0.0, yaw), Twist2D(v, 0.0)
    return RecordingEntry(at, Odometry("", Origin(), pose, twist))


def looked(at: float, *xs: float) -> RecordingEntry:
    boxes = [Box3D(x - 0.5, x + 0.5, 0.0, 1.0, 0.0, 1.0) for x in xs]
    detections = tuple(Detection("farmer", 0.9, box, "map") for box in boxes)
    return RecordingEntry(at, DetectionFrame("", Origin(), detections))


def log(*entries: RecordingEntry) -> Callable[[], Iterator[RecordingEntry]]:
    return lambda: iter(entries)


def test_poses_between_two_recorded_ones_are_interpolated() -> None:
    playback = Playback(log(moved(0.0, 0.0), moved(1.0, 2.0, v=3.0)), loop=False)

    playback.advance(0.25)

    pose, twist = playback.motion
    assert pose.x == pytest.approx(0.5)
    assert twist.linear_x == pytest.approx(1.5)


@pytest.mark.parametrize("loop", [False, True])
def test_a_frame_counts_until_the_next_and_a_silent_detector_is_none(
    loop: bool,
) -> None:
    frames = looked(0.5, 1.0, 5.0), looked(1.1)
    entries = moved(0.0, 0.0), *frames, moved(2.0, 1.0), moved(3.0, 1.0)
    playback = Playback(log(*entries), loop=loop)

    shown = []
    for step_s in (0.0, 0.6, 0.6, 1.0):
        playback.advance(step_s)
        frame = playback.frame
        shown.append(None if frame is None else len(frame.detections))

    assert shown == [None, 2, 0, None]


def test_a_loop_starts_over_and_never_ends() -> None:
    playback = Playback(log(moved(0.0, 0.0), moved(1.0, 2.0)), loop=True)

    playback.advance(1.1)
    playback.advance(0.5)

    assert not playback.ended
    assert playback.motion[0].x == pytest.approx(1.0)


# --- recordings -------------------------------------------------------------------

MOUNT = Pose2D(0.2, 0.0, 0.1)
Write = Callable[[Path, Sequence[Said]], Path]
KINDS = [
    pytest.param(db3_bag, "run", id="db3"),
    pytest.param(mcap_bag, "run", id="mcap"),
    pytest.param(bag_directory, "run", id="directory"),
]


def entries(path: Path, named: NamedTopics = AS_RECORDED) -> list[RecordingEntry]:
    return list(open_recording(path, MOUNT, named)())


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

    assert (odometry.at, scan.at) == pytest.approx((0.0, 0.25))
    assert isinstance(odometry.observation, Odometry)
    assert odometry.observation.pose.x == 1.0
    assert odometry.observation.pose.yaw == pytest.approx(2.5)
    assert odometry.observation.twist == Twist2D(0.5, 0.25)
    assert isinstance(scan.observation, LaserScan)
    assert scan.observation.mount == MOUNT
    assert scan.observation.ranges.tolist() == pytest.approx(
        [1.0, math.inf, 0.0, 0.0, 0.2]
    )


@pytest.mark.parametrize(
    ("topics", "why"),
    [
        (AS_RECORDED, r"--odom-topic must name one of .*: /odom, /raw\.$"),
        ({"odometry": "/scan"}, r"--odom-topic must name one of .*: /odom, /raw\.$"),
        ({"odometry": "/raw", "scan": "/gone"}, r"--scan-topic must .*: /scan\.$"),
    ],
)
def test_topics_that_leave_open_what_is_meant_are_listed(
    topics: NamedTopics, why: str, tmp_path: Path
) -> None:
    said = [Said("/raw", ODOMETRY, 1.0), *drive(0.2)]

    with pytest.raises(DataFileError, match=why):
        entries(mcap_bag(tmp_path / "run", said), topics)


def test_a_message_that_cannot_be_used_is_reported_once_and_skipped(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    said = drive(1.0)
    said[2] = replace(said[2], raw=b"\x00\x01\x00\x00nothing")
    said[4] = replace(said[4], x=math.nan)
    recording = open_recording(db3_bag(tmp_path / "run", said), MOUNT)

    assert len(poses(list(recording()))) == len(poses(list(recording()))) == 8

    (told,) = caplog.messages
    assert "/odom: unusable messages are skipped" in told


@pytest.mark.parametrize(("write", "name"), KINDS[:2])
@pytest.mark.parametrize("kept", [0.0, 0.2, 0.5, 0.9])
def test_a_bag_that_was_cut_off_never_ends_in_anything_but_a_sentence(
    write: Write, name: str, kept: float, tmp_path: Path
) -> None:
    file = write(tmp_path / name, drive(20.0))
    whole = file.read_bytes()
    file.write_bytes(whole[: int(len(whole) * kept)])

    with pytest.raises(DataFileError, match=f"{file.name}: cannot be read: "):
        entries(file)
