"""What contradicts physics, or what a robot said before, and what does not."""

from dataclasses import replace

import pytest

from iveg.domain.geometry import Rectangle
from iveg.domain.world import World
from tests.builders import (
    at,
    fleet_of,
    odometry,
    origin,
    received,
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
    [(50.1, {"pose_outside"}), (49.9, set()), (-0.1, {"pose_outside"})],
)
def test_a_pose_is_within_the_bounds_of_where_robots_may_be(
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


@pytest.mark.parametrize(("x", "found"), [(10.6, set()), (11.5, {"jumped"})])
def test_no_robot_goes_farther_than_its_drive_takes_it(
    x: float, found: set[str]
) -> None:
    world = house()
    say(world, 0.0)
    say(world, 0.1, x)
    assert codes(world) == found


def test_a_clock_that_tells_hours_between_two_messages_excuses_no_jump() -> None:
    world = house()
    say(world, 0.0)
    late = origin(9, after=7200.0)
    world.apply(received(odometry("AGI", 40.0, 10.0, origin=late), after=0.1))
    assert codes(world) == {"jumped"}
