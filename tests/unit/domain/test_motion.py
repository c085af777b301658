"""Motion of a robot by its poses, twists and reports, whatever one of them says."""

from collections.abc import Callable
from math import cos, sin

import pytest

from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.motion import Motion, MotionTrack
from iveg.domain.observations import Origin

Way = Callable[[float], tuple[float, float, float]]


def driven(
    way: Way, *, says: float = 0.0, turns: float = 0.0, hz: float = 10.0
) -> list[tuple[float, Motion]]:
    """Motion at each of the messages of four seconds; ``way`` is x, y, yaw by time."""
    track = MotionTrack()
    moments = [number / hz for number in range(int(4 * hz) + 1)]
    return [
        (t, track.note_odometry(Pose2D(*way(t)), Twist2D(says, turns), t))
        for t in moments
    ]


def straight(speed: float) -> Way:
    return lambda t: (speed * t, 0.0, 0.0)


def test_a_pose_that_turns_is_motion_whatever_the_twist_says() -> None:
    found = driven(lambda t: (0.0, 0.0, 0.3 * t))

    assert all(motion.moves and not motion.speed for t, motion in found if t >= 1.0)
    assert found[-1][1].contradiction == "yaw_against_turn"


@pytest.mark.parametrize(
    ("way", "says", "turns", "code"),
    [
        (straight(0.3), 0.0, 0.0, "pose_against_twist"),
        (straight(0.0), 0.5, 0.0, "pose_against_twist"),
        (straight(-0.5), 0.5, 0.0, "pose_against_twist"),
        (lambda t: (0.0, 0.3 * t, 0.0), 0.0, 0.0, "sideways"),
        (straight(0.0), 0.0, 0.5, "yaw_against_turn"),
        (straight(0.5), 0.5, 0.0, None),
        (straight(-0.5), -0.5, 0.0, None),
        (lambda t: (sin(t), 1 - cos(t), t), 1.0, 1.0, None),
    ],
)
@pytest.mark.parametrize("hz", [2, 10, 30])
def test_fields_that_cannot_both_be_contradict_within_seven_tenths(
    way: Way, says: float, turns: float, code: str | None, hz: int
) -> None:
    found = driven(way, says=says, turns=turns, hz=hz)

    late = 1.0 if hz == 2 else 0.7
    assert {motion.contradiction for t, motion in found if t >= late} == {code}


def test_motion_goes_on_the_way_that_the_pose_goes() -> None:
    motion = driven(lambda t: (0.0, 0.3 * t, 0.0))[-1][1]

    pose, twist = motion.ahead(Pose2D(0.0, 1.2, 0.0), Twist2D(0.0, 0.0))

    assert (pose.yaw, twist.linear_x) == pytest.approx((1.5708, 0.3), abs=0.02)


def test_messages_in_a_burst_show_the_motion_of_when_they_were_measured() -> None:
    track = MotionTrack()

    for number in range(40):
        origin = Origin("a", number, mono=number / 10)
        twist = Twist2D(0.3, 0.0)
        motion = track.note_odometry(Pose2D(0.03 * number, 0, 0), twist, 9.0, origin)

    assert motion.speed == pytest.approx(0.3, abs=0.01)
    assert motion.contradiction is None


@pytest.mark.parametrize(
    ("origin_of", "since"),
    [
        (lambda number: Origin("a", number, mono=float(number)), 30),
        (lambda number: Origin(f"a{number}", 1, mono=50.0 - number), 10),
        (lambda number: Origin("a", 1, mono=50.0 - number), 10),
    ],
    ids=["ten times as fast a clock", "boots that change", "a clock that runs back"],
)
def test_no_clock_boot_or_count_hides_motion(
    origin_of: Callable[[int], Origin], since: int
) -> None:
    track, moves = MotionTrack(), []

    for number in range(60):
        pose = Pose2D(0.03 * number, 0.0, 0.0)
        said = pose, Twist2D(0.0, 0.0), number / 10, origin_of(number)
        moves.append(track.note_odometry(*said).moves)

    assert all(moves[since:])


def test_the_largest_speed_of_the_last_second_counts_for_a_second() -> None:
    track = MotionTrack()
    track.note_report(0.4, 0.0, 1.0)

    track.note_odometry(Pose2D(0, 0, 0), Twist2D(0.0, 0.0), 1.5)
    still = track.motion.speed
    track.note_odometry(Pose2D(0, 0, 0), Twist2D(0.0, 0.0), 2.1)

    assert (still, track.motion.speed, track.motion.moves) == (0.4, 0.0, False)
