"""When a detector asks for people, and under which name."""

from dataclasses import replace

import pytest

from iveg.domain import alerts
from iveg.domain.detector import OutOfService
from iveg.domain.observations import RefusedFrame
from iveg.domain.world import World
from tests.builders import START, at, detection_frame, odometry, origin, received


def test_out_of_service_it_is_a_notice_and_without_a_detector_nothing() -> None:
    robot = driving().robot("AGI")
    robot.detector.out_of_service = OutOfService("maria", 1.0)

    (found,) = alerts.of_detector(robot, at(0.0), started=at(-60.0))

    assert (found.priority, found.key) == ("P3", "alert.detector_out_of_service")
    world = driving()
    robot = world.robot("AGI")
    robot.description = replace(robot.description, has_detector=False)
    assert keys(world, 0.0) == []


def driving(world: World | None = None, now: float = 0.0) -> World:
    """AGI tells its pose at ``now``."""
    world = world or World(["AGI"])
    said = odometry("AGI", origin=origin(round(100 * now), after=now))
    world.apply(received(said, after=now))
    return world


def keys(world: World, now: float, started: float = -60.0) -> list[str]:
    robot = world.robot("AGI")
    found = [*alerts.of_detector(robot, at(now), started=at(started))]
    assert {one.priority for one in found} <= {"P2"}
    return [one.key for one in found]


def worked() -> World:
    """AGI's detector has worked at 0."""
    world = driving()
    world.robot("AGI").detector.note_whole(START.mono)
    return world


def test_a_detector_that_worked_and_falls_silent_is_told_at_once() -> None:
    world = driving(worked(), 1.0)

    assert keys(world, 1.01) == []
    driving(world, 1.1)
    assert keys(world, 1.1) == ["alert.detector_silent"]


def test_of_a_robot_that_is_silent_itself_or_just_came_back_it_is_no_news() -> None:
    world = worked()
    assert [keys(world, now) for now in (2.0, 4.0)] == [[], []]

    told = [keys(driving(world, now), now) for now in (20.0, 20.5, 21.0, 21.5)]

    assert told == [[], [], [], ["alert.detector_silent"]]


@pytest.mark.parametrize(("since", "told"), [(9.9, False), (10.0, True)])
def test_one_that_never_worked_has_ten_seconds_to_begin(
    since: float, *, told: bool
) -> None:
    assert bool(keys(driving(), 0.0, -since)) is told


def test_a_refused_frame_is_told_for_ten_seconds() -> None:
    world = driving()
    world.apply(received(RefusedFrame("AGI")))
    driving(world, 9.0)
    world.robot("AGI").detector.note_whole(at(9.5).mono)

    assert keys(world, 9.9) == ["alert.unreadable_detection"]
    assert keys(world, 10.1) == []


@pytest.mark.parametrize(
    ("now", "flawed", "told"),
    [
        (0.5, 0.5, []),
        (9.9, 9.9, []),
        (10.0, 10.0, ["alert.unreadable_detection"]),
        (10.5, 9.4, ["alert.detector_silent"]),
    ],
)
def test_somebody_seen_before_the_first_pose_is_no_alert_while_iveg_starts(
    now: float, flawed: float, told: list[str]
) -> None:
    world = World(["AGI"])
    world.robot("AGI").detector.note_flaw("unplaced", at(flawed))

    assert keys(world, now, 0.0) == told


def test_a_detector_by_another_clock_is_not_called_silent() -> None:
    world = World(["AGI"])
    for seq, now in enumerate((0.0, 1.0, 2.0)):
        driving(world, now)
        frame = detection_frame("AGI", origin=origin(seq, after=now - 600.0))
        world.apply(received(frame, after=now))
        assert keys(world, now) == (["alert.detector_clock"] if now == 2.0 else [])
