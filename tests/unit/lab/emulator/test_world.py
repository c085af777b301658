"""What sensors of the simulated world say, and what is true."""

from collections.abc import Iterator
from typing import Any

import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import PERSON_RADIUS_M
from iveg.domain.greenhouse import Greenhouse
from iveg.lab.emulator.camera import DETECTORS, PERSON, Counts, DetectorModel
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import SCENARIOS, scenario_named
from iveg.lab.emulator.world import SimulatedWorld, true_picture
from tests.touching import bodies_touch, touches

BLIND = DetectorModel(0.9, counts={"farmer": Counts(0, 0, 1), "AGI": Counts(0, 0, 1)})


def test_everybody_is_in_the_truth_with_the_robot_s_true_pose() -> None:
    greenhouse = load_greenhouse(scenario_named("demo").greenhouse)
    layout = lay_out(scenario_named("demo"), ("AGI", "AGII"), greenhouse)
    world = SimulatedWorld(greenhouse, layout, BLIND, seed=1)

    told: Any = true_picture(world.rigs["AGI"], world, 1000.5, 0.6, 0.5)

    pose = world.rigs["AGI"].vehicle.pose
    assert [one["key"] for one in told["people"]] == [f"person-{n}" for n in range(4)]
    assert [one["x"] for one in told["people"]] == [
        round(one.x, 3) for one in world.discs()
    ]
    assert (told["pose"]["x"], told["speed"]) == (round(pose.x, 3), 0.0)
    assert (told["wanted"], told["factor"]) == (0.6, 0.5)


FLEET = ("AGI", "AGII")
TEN = tuple(f"R{n}" for n in range(10))
TESTBED = load_greenhouse("mvsim-20x20")


def world_of(
    scenario: str,
    robots: tuple[str, ...] = FLEET,
    greenhouse: Greenhouse = TESTBED,
    *,
    seed: int = 1,
    detector: str = "perfect",
) -> SimulatedWorld:
    layout = lay_out(scenario_named(scenario), robots, greenhouse)
    return SimulatedWorld(greenhouse, layout, DETECTORS[detector], seed)


def run(world: SimulatedWorld, seconds: float, dt: float = 0.1) -> Iterator[float]:
    """Drive everybody as they wish; yields the time after every step."""
    for step in range(round(seconds / dt)):
        now = step * dt
        for rig in world.rigs.values():
            rig.drive(rig.requested_twist(now, world))
        for rig in world.rigs.values():
            rig.move(dt)
        world.walk(dt)
        yield now


def nearest_person(world: SimulatedWorld, robot_id: str) -> float:
    pose = world.rigs[robot_id].vehicle.pose
    return min(pose.distance_to(person.x, person.y) for person in world.people)


@pytest.mark.slow
@pytest.mark.parametrize("scenario", sorted(SCENARIOS))
def test_robots_drive_without_touching_anything_or_anybody(scenario: str) -> None:
    greenhouse = load_greenhouse(scenario_named(scenario).greenhouse)
    world = world_of(scenario, greenhouse=greenhouse)

    for _ in run(world, 100.0):
        bodies = world.bodies()
        assert not any(touches(world.scenery, body) for body in bodies)
        assert not bodies_touch(bodies)
        for person in world.people:
            gaps = [body.gap_to(person.x, person.y)[0] for body in bodies]
            assert min(gaps) > PERSON_RADIUS_M


@pytest.mark.slow
@pytest.mark.parametrize(
    ("robots", "greenhouse"),
    [
        (TEN, "mvsim-20x20"),
        (("AGI", "AGII", "R1"), "agroconnect"),
        (("AGI", "AGII"), "none"),
    ],
)
def test_every_robot_of_any_fleet_drives_in_any_greenhouse(
    robots: tuple[str, ...], greenhouse: str
) -> None:
    world = world_of("demo", robots, load_greenhouse(greenhouse))
    driven = dict.fromkeys(robots, 0.0)

    for _ in run(world, 60.0):
        assert not any(touches(world.scenery, body) for body in world.bodies())
        assert not bodies_touch(world.bodies())
        for robot_id, rig in world.rigs.items():
            driven[robot_id] += abs(rig.vehicle.twist.linear_x) * 0.1

    assert min(driven.values()) > 15.0


def test_agii_of_the_field_test_never_looks_at_the_grower() -> None:
    world = world_of("nlos-field", greenhouse=load_greenhouse("agroconnect"))
    rig = world.rigs["AGII"]
    passed = 0

    for now in run(world, 60.0):
        passed += nearest_person(world, "AGII") <= 2.0
        assert PERSON not in {d.class_id for d in rig.detect(now, world).detections}

    assert passed > 20


def test_a_greenhouse_without_room_for_the_fleet_is_refused() -> None:
    crowd = tuple(f"R{n}" for n in range(30))

    with pytest.raises(DataFileError, match="has room for 20 robots"):
        world_of("many", crowd)
    with pytest.raises(DataFileError, match="has 23 lanes, too few for 30"):
        world_of("many", crowd, load_greenhouse("agroconnect"))
