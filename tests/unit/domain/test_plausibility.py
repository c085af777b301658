"""What contradicts physics, or what a robot said before, and what does not."""

import pytest

from iveg.domain.geometry import Rectangle
from iveg.domain.world import World
from tests.builders import fleet_of, odometry, origin, received


def house() -> World:
    return World(fleet_of("AGI"), bounds=Rectangle(0.0, 0.0, 50.0, 37.0))


def say(
    world: World,
    moment: float,
    x: float = 10.0,
    *,
    linear: float = 0.0,
    angular: float = 0.0,
    stamp: float | None = None,
) -> None:
    """AGI tells where it is, by its clock at ``stamp`` (s)."""
    name = origin(round(moment * 100), after=moment if stamp is None else stamp)
    one = odometry("AGI", x, 10.0, linear=linear, angular=angular, origin=name)
    world.apply(received(one, after=moment))


def codes(world: World) -> set[str]:
    """What was contradicted so far."""
    found = (name.partition(".") for name in world.counters)
    return {code for kind, _, code in found if kind == "contradicted"}


@pytest.mark.parametrize(
    ("x", "linear", "angular", "found"),
    [
        (49.9, 1.4, 1.9, set()), (50.1, 0.0, 0.0, {"pose_outside"}),
        (-0.1, 0.0, 0.0, {"pose_outside"}), (10.0, -1.6, 0.0, {"too_fast"}),
        (10.0, 0.0, 2.1, {"too_fast"}),
    ],
)  # fmt: skip
def test_a_robot_is_within_its_bounds_and_no_faster_than_its_drive(
    x: float, linear: float, angular: float, found: set[str]
) -> None:
    world = house()
    say(world, 0.0, x, linear=linear, angular=angular)
    assert codes(world) == found


@pytest.mark.parametrize(
    ("x", "stamp", "found"),
    [(10.6, 0.1, set()), (11.5, 0.1, {"jumped"}), (40.0, 7200.0, {"jumped"})],
    ids=["plausible", "too far", "hours later by its clock"],
)
def test_no_robot_goes_farther_than_its_drive_takes_it(
    x: float, stamp: float, found: set[str]
) -> None:
    world = house()
    say(world, 0.0)
    say(world, 0.1, x, stamp=stamp)
    assert codes(world) == found
