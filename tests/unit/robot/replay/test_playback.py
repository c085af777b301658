from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from iveg.domain.geometry import Box3D, Pose2D, Twist2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Odometry,
    Origin,
)
from iveg.robot.replay.logs import LogReader, RecordingEntry
from iveg.robot.replay.playback import Playback
from tests import data
from tests.builders import scan
from tests.unit.domain.scene import Scene

DATA = Path(data.__file__).parent


def moved(at: float, x: float, yaw: float = 0.0, v: float = 1.0) -> RecordingEntry:
    pose, twist = Pose2D(x, 0.0, yaw), Twist2D(v, 0.0)
    return RecordingEntry(at, Odometry("", Origin(), pose, twist))


def swept(at: float) -> RecordingEntry:
    return RecordingEntry(at, scan())


def saw(at: float, x: float = 0.5) -> RecordingEntry:
    box = Box3D(x - 0.5, x + 0.5, 0.0, 1.0, 0.0, 1.0)
    return RecordingEntry(at, Detection("farmer", 0.9, box, "map"))


def log(*entries: RecordingEntry) -> Callable[[], Iterator[RecordingEntry]]:
    return lambda: iter(entries)


def test_poses_between_two_recorded_ones_are_interpolated() -> None:
    playback = Playback(log(moved(0.0, 0.0), moved(1.0, 2.0, v=3.0)), loop=False)

    playback.advance(0.25)

    pose, twist = playback.motion
    assert pose.x == pytest.approx(0.5)
    assert twist.linear_x == pytest.approx(1.5)


def test_a_turn_across_the_seam_of_angles_is_the_short_one() -> None:
    entries = moved(0.0, 0.0, yaw=3.1), moved(1.0, 0.0, yaw=-3.1)
    playback = Playback(log(*entries), loop=False)

    playback.advance(0.5)

    assert abs(playback.motion[0].yaw) > 3.1


def test_a_recording_begins_at_its_first_entry_whatever_its_time() -> None:
    playback = Playback(log(moved(100.0, 0.0), moved(101.0, 1.0)), loop=False)

    playback.advance(0.5)

    assert playback.motion[0].x == pytest.approx(0.5)


def test_the_newest_sweep_stays_until_the_next() -> None:
    first, second = swept(0.1), swept(0.6)
    playback = Playback(
        log(moved(0.0, 0.0), first, second, moved(1.0, 1.0)), loop=False
    )

    shown = [playback.scan]
    for _ in range(3):
        playback.advance(0.25)
        shown.append(playback.scan)

    assert shown == [None, first.observation, first.observation, second.observation]


def test_a_detection_is_seen_for_a_moment_of_the_recording() -> None:
    playback = Playback(log(moved(0.0, 0.0), saw(0.5), moved(9.0, 1.0)), loop=False)
    at_first = playback.has_detector

    playback.advance(0.6)
    seen, later = playback.detections, playback.has_detector
    playback.advance(0.0)
    paused = playback.detections
    playback.advance(1.0)

    assert len(seen) == 1
    assert (at_first, later) == (False, True)
    assert paused == seen
    assert playback.detections == ()


def looked(at: float, *xs: float, unread: tuple[str, ...] = ()) -> RecordingEntry:
    boxes = tuple(saw(at, x).observation for x in xs)
    detections = tuple(one for one in boxes if isinstance(one, Detection))
    return RecordingEntry(at, DetectionFrame("", Origin(), detections, unread))


def test_a_whole_frame_counts_until_the_next_and_an_empty_one_is_empty() -> None:
    frames = looked(0.2, 1.0, 5.0, unread=("farmer",)), looked(1.1)
    entries = moved(0.0, 0.0), *frames, moved(9.0, 1.0)
    playback = Playback(log(*entries), loop=False)

    playback.advance(0.7)
    both, lost = playback.detections, playback.unread
    playback.advance(0.5)

    assert [one.box.xmin for one in both] == [0.5, 4.5]
    assert lost == ("farmer",)
    assert (playback.detections, playback.unread) == ((), ())
    assert playback.has_detector


@pytest.mark.parametrize("loop", [False, True])
def test_a_detector_of_whole_frames_that_falls_silent_sees_nobody_no_longer(
    loop: bool,
) -> None:
    entries = moved(0.0, 0.0), looked(0.5, 1.0), moved(2.0, 1.0), moved(3.0, 1.0)
    playback = Playback(log(*entries), loop=loop)

    playback.advance(1.4)
    seen = playback.has_detector
    playback.advance(0.2)
    silent = playback.has_detector
    playback.advance(1.5)

    assert (seen, silent) == (True, False)
    assert not playback.has_detector
    assert playback.detections == ()


def test_of_pictures_that_follow_each_other_the_newest_is_seen_alone() -> None:
    walk = [saw(0.1 * step, 0.15 * step) for step in range(1, 5)]
    playback = Playback(log(moved(0.0, 0.0), *walk, moved(9.0, 1.0)), loop=False)

    playback.advance(0.45)

    assert playback.detections == (walk[-1].observation,)


def test_people_of_one_picture_are_all_seen_whatever_milliseconds_it_took() -> None:
    two = saw(0.30, 1.0), saw(0.31, 5.0)
    entries = moved(0.0, 0.0), saw(0.2, 9.0), *two, moved(9.0, 1.0)
    playback = Playback(log(*entries), loop=False)

    playback.advance(0.4)

    assert playback.detections == tuple(one.observation for one in two)


def test_one_person_who_walks_through_a_log_is_one_person_on_the_map() -> None:
    walk = [saw(0.1 * step, 0.15 * step) for step in range(60)]
    playback = Playback(log(moved(0.0, 0.0), *walk, moved(9.0, 1.0)), loop=False)
    scene = Scene(robots=("D1:recording",))
    most = 0

    for _ in range(30):
        playback.advance(0.2)
        scene.now += 0.2
        scene.look("D1", *playback.detections)
        most = max(most, len(scene.everyone))

    assert most == 1


def test_a_recording_ends_after_its_last_entry() -> None:
    playback = Playback(log(moved(0.0, 0.0), moved(1.0, 2.0)), loop=False)

    playback.advance(0.9)
    before = playback.ended
    playback.advance(0.2)

    assert not before
    assert playback.ended
    assert playback.motion[0].x == 2.0


def test_a_loop_starts_over_and_never_ends() -> None:
    playback = Playback(log(moved(0.0, 0.0), moved(1.0, 2.0)), loop=True)

    playback.advance(1.1)
    playback.advance(0.5)

    assert not playback.ended
    assert playback.motion[0].x == pytest.approx(1.0)


def test_many_sweeps_before_the_first_pose_are_no_hindrance() -> None:
    entries = [swept(0.0)] * 1_000 + [moved(1.0, 7.0)]
    playback = Playback(log(*entries), loop=False)

    assert playback.motion[0].x == 7.0
    assert isinstance(playback.scan, LaserScan)


def test_the_synthetic_aisle_is_driven_there_and_back() -> None:
    playback = Playback(LogReader(DATA / "aisle.jsonl").entries, loop=False)
    xs = []

    for _ in range(300):
        playback.advance(0.05)
        xs.append(playback.motion[0].x)

    assert max(xs) == pytest.approx(4.0)
    assert xs[-1] == pytest.approx(0.0)
    assert playback.ended
