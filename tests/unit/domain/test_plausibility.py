"""What contradicts physics, or what a robot said before, and what does not."""

from dataclasses import replace

import pytest

from iveg.domain.geometry import Rectangle
from iveg.domain.observations import FeedbackRef, Observation, Odometry
from iveg.domain.plausibility import ignores_limit
from iveg.domain.world import World
from tests.builders import (
    at,
    fleet_of,
    odometry,
    origin,
    received,
    safety_report,
)

HOUSE = Rectangle(0.0, 0.0, 50.0, 37.0)


def house(*words: str) -> World:
    return World(fleet_of(*(words or ("AGI",))), bounds=HOUSE)


def say(world: World, moment: float, x: float = 10.0, **more: float) -> None:
    """AGI tells where it is."""
    one = odometry("AGI", x, 10.0, origin=origin(round(moment * 100), after=moment))
    twist = replace(one.twist, **{f"{key}": value for key, value in more.items()})
    world.apply(received(replace(one, twist=twist), after=moment))


def codes(world: World) -> set[str]:
    """What was contradicted so far."""
    found = (name.partition(".") for name in world.counters)
    return {code for kind, _, code in found if kind == "contradicted"}


def doubts(world: World, moment: float) -> tuple[str, ...]:
    return world.robot("AGI").doubts.active(at(moment))


@pytest.mark.parametrize(
    ("x", "found"),
    [(99.9, set()), (100.1, {"pose_outside"}), (-50.1, {"pose_outside"})],
)
def test_a_pose_may_be_outside_by_no_more_than_the_size_of_the_greenhouse(
    x: float, found: set[str]
) -> None:
    world = house()
    say(world, 0.0, x)
    assert codes(world) == found


@pytest.mark.parametrize(
    ("motion", "found"),
    [
        ({"linear_x": 1.4}, set()),
        ({"linear_x": -1.6}, {"too_fast"}),
        ({"angular_z": 1.9}, set()),
        ({"angular_z": 2.1}, {"too_fast"}),
    ],
)
def test_no_robot_is_faster_than_its_drive(
    motion: dict[str, float], found: set[str]
) -> None:
    world = house()
    say(world, 0.0, **motion)
    assert codes(world) == found


def test_a_robot_that_nobody_described_may_be_fast() -> None:
    world = World(["R9"], bounds=HOUSE)
    said = odometry("R9", 10.0, 10.0, linear=9.0)
    world.apply(received(said))
    assert codes(world) == set()


@pytest.mark.parametrize(("x", "found"), [(10.6, set()), (11.5, {"jumped"})])
def test_no_robot_goes_farther_than_its_drive_takes_it(
    x: float, found: set[str]
) -> None:
    world = house()
    say(world, 0.0)
    say(world, 0.1, x)
    assert codes(world) == found


def test_after_a_silence_it_may_be_farther_away() -> None:
    world = house()
    say(world, 0.0)
    say(world, 5.0, 16.0)
    assert codes(world) == set()


def test_messages_that_come_together_are_judged_by_the_robots_own_clock() -> None:
    world = house()
    for number in range(4):
        moment = origin(number, after=1.0 * number)
        said = odometry("AGI", 10.0 + number, 10.0, origin=moment)
        world.apply(received(said, after=9.0))
    assert codes(world) == set()


def test_a_clock_that_tells_hours_between_two_messages_excuses_no_jump() -> None:
    world = house()
    say(world, 0.0)
    late = origin(9, after=7200.0)
    world.apply(received(odometry("AGI", 40.0, 10.0, origin=late), after=0.1))
    assert codes(world) == {"jumped"}


def test_another_boot_may_begin_anywhere() -> None:
    world = house()
    say(world, 0.0)
    said = odometry("AGI", 40.0, 10.0, origin=origin(1, boot="boot-b", after=0.1))
    world.apply(received(said, after=0.1))
    assert codes(world) == set()


def test_a_localisation_that_corrects_itself_once_is_believed() -> None:
    world = house()
    for number in range(20):
        say(world, 0.1 * number, 10.0 if number < 10 else 30.0)
    assert codes(world) == {"jumped"}
    assert doubts(world, 1.9) == ()


def test_one_that_is_here_and_there_is_doubted_until_it_makes_up_its_mind() -> None:
    world = house()
    for number in range(10):
        say(world, 0.1 * number, 10.0 if number % 2 else 30.0)
    assert doubts(world, 0.9) == ("jumped",)
    for number in range(10, 22):
        say(world, 0.1 * number, 10.0)
    assert doubts(world, 2.1) == ()


def test_a_recording_may_jump() -> None:
    world = house("AGI:recording")
    say(world, 0.0)
    say(world, 0.1, 400.0)
    assert codes(world) == set()


@pytest.mark.parametrize(
    ("heard", "found"),
    [
        (FeedbackRef("iveg", 7), set()),
        (FeedbackRef("iveg", 8), {"heard_unsent"}),
        (FeedbackRef("earlier", 99), set()),
        (None, set()),
    ],
)
@pytest.mark.parametrize("kind", ["odometry", "report"])
def test_nobody_hears_what_was_never_sent(
    heard: FeedbackRef | None, found: set[str], kind: str
) -> None:
    world = house()
    world.ledger.composed("iveg", 1, 7, at(0.0).mono)
    moment = replace(origin(1), acknowledgements=True, heard=heard)
    said: dict[str, Observation] = {
        "odometry": odometry("AGI", 10.0, 10.0, origin=moment),
        "report": safety_report("AGI", origin=moment),
    }
    world.apply(received(said[kind]))
    assert codes(world) == found


def driven(mono: float, linear: float) -> Odometry:
    moment = replace(origin(round(mono * 100), after=mono), mono=mono)
    return odometry("AGI", 10.0, 10.0, linear=linear, origin=moment)


@pytest.mark.parametrize(
    ("linear", "apart_s", "found"),
    [
        (0.5, 0.0, {"stands_moving"}),
        (0.5, 0.11, set()),
        (0.19, 0.0, set()),
        (0.0, 0.0, set()),
    ],
)
def test_nobody_stands_while_the_wheels_turn(
    linear: float, apart_s: float, found: set[str]
) -> None:
    world = house()
    world.apply(received(driven(1.0, linear), after=1.0))
    moment = replace(origin(1, after=1.0), mono=1.0 + apart_s)
    world.apply(received(safety_report("AGI", origin=moment), after=1.0))
    assert codes(world) == found


@pytest.mark.parametrize(
    ("factor", "waited", "ignores"),
    [(1.0, 2.1, True), (1.0, 1.9, False), (0.5, 60.0, False), (0.0, 60.0, False)],
)
def test_a_limit_is_ignored_by_who_drives_on_above_it_after_two_seconds(
    factor: float, waited: float, *, ignores: bool
) -> None:
    report = safety_report("AGI", speed_factor=factor)
    assert ignores_limit(report, 10.0 + waited, 10.0) is ignores
