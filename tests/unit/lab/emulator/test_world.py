import math
from collections.abc import Iterator
from dataclasses import replace

import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.errors import DataFileError
from iveg.domain.geometry import PERSON_RADIUS_M, Twist2D
from iveg.domain.greenhouse import Greenhouse
from iveg.lab.emulator.climate import climate_at
from iveg.lab.emulator.detector_model import DETECTORS, PERSON
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import SCENARIOS, scenario_named
from iveg.lab.emulator.scripts import SiteErrors
from iveg.lab.emulator.world import SimulatedWorld
from tests.touching import bodies_touch, touches

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


def test_a_plan_may_be_off_and_poses_err_more_than_usual() -> None:
    errors = SiteErrors(plan_off_m=0.2, pose_error=3.0)
    scenario = replace(scenario_named("demo"), errors=errors)
    layout = lay_out(scenario, FLEET, TESTBED)
    off = SimulatedWorld(TESTBED, layout, DETECTORS["perfect"], 1)
    exact = world_of("demo")

    row = TESTBED.rows[0]
    just_east = row.xmax + 0.1, (row.ymin + row.ymax) / 2
    assert exact.scenery.free(*just_east, 0.01)
    assert not off.scenery.free(*just_east, 0.01)
    assert off.scenery.bounds == exact.scenery.bounds
    for one in (off, exact):
        rig = one.rigs["AGI"]
        rig.drive(Twist2D(0.5, 0.0))
        rig.move(1.0)
    missed = [
        one.rigs["AGI"].vehicle.pose.distance_to(said.x, said.y)
        for one in (off, exact)
        if (said := one.rigs["AGI"].odometry().pose)
    ]
    assert missed[0] == pytest.approx(3.0 * missed[1], rel=1e-6)


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


def test_both_robots_of_the_demo_meet_people_in_the_first_minute_and_again() -> None:
    world = world_of("demo")
    met: dict[str, set[int]] = {robot_id: set() for robot_id in FLEET}

    for now in run(world, 240.0):
        for robot_id in FLEET:
            if nearest_person(world, robot_id) <= 2.0:
                met[robot_id].add(int(now // 80.0))

    assert met == {"AGI": {0, 1, 2}, "AGII": {0, 1, 2}}


@pytest.mark.parametrize("scenario", ["demo", "nlos", "nlos-field"])
def test_agii_passes_a_person_whom_only_agi_sees(scenario: str) -> None:
    greenhouse = load_greenhouse(scenario_named(scenario).greenhouse)
    world = world_of(scenario, greenhouse=greenhouse)
    unseen = 0

    for now in run(world, 60.0):
        pose = world.rigs["AGII"].vehicle.pose
        close = [p for p in world.people if pose.distance_to(p.x, p.y) <= 2.0]
        hidden = [p for p in close if not greenhouse.in_sight(pose.x, pose.y, p.x, p.y)]
        seen_by_agi = [
            detection
            for detection in world.rigs["AGI"].detect(now, world).detections
            if detection.class_id == PERSON
        ]
        unseen += bool(hidden and seen_by_agi)

    assert unseen > 5


def test_agii_of_the_field_test_never_looks_at_the_grower() -> None:
    world = world_of("nlos-field", greenhouse=load_greenhouse("agroconnect"))
    rig = world.rigs["AGII"]
    passed = 0

    for now in run(world, 60.0):
        passed += nearest_person(world, "AGII") <= 2.0
        assert PERSON not in {d.class_id for d in rig.detect(now, world).detections}

    assert passed > 20


def test_a_scenario_about_one_greenhouse_is_refused_in_another() -> None:
    with pytest.raises(DataFileError, match="is about agroconnect, not mvsim-20x20"):
        world_of("nlos-field")


def test_one_lap_of_viewpoints_shows_the_person_from_south_and_north() -> None:
    world = world_of("viewpoints")
    seen_from: set[bool] = set()

    for now in run(world, 40.0):
        rig = world.rigs["AGI"]
        if any(d.class_id == PERSON for d in rig.detect(now, world).detections):
            seen_from.add(rig.vehicle.pose.y > world.people[0].y)

    assert seen_from == {False, True}


def test_agi_and_agii_of_peers_come_within_two_metres_and_see_each_other() -> None:
    world = world_of("peers")
    near, named = 0, set()

    for now in run(world, 120.0):
        agi, agii = (world.rigs[robot_id].vehicle.pose for robot_id in FLEET)
        near += agi.distance_to(agii.x, agii.y) <= 2.0
        found = world.rigs["AGI"].detect(now, world).detections
        named |= {detection.class_id for detection in found}

    assert near > 5
    assert named == {"AGII"}


def test_a_person_and_agii_are_in_one_frame_of_together() -> None:
    world = world_of("together")

    frames = [
        {d.class_id for d in world.rigs["AGI"].detect(now, world).detections}
        for now in run(world, 60.0)
    ]

    assert {PERSON, "AGII"} in frames


def test_the_person_of_occluded_is_seen_in_part() -> None:
    world = world_of("occluded")
    sure = [
        detection.probability
        for now in run(world, 100.0)
        for detection in world.rigs["AGI"].detect(now, world).detections
        if detection.class_id == PERSON
    ]

    assert min(sure) < 0.93
    assert max(sure) == pytest.approx(0.95)


def test_the_same_seed_gives_the_same_run() -> None:
    one, other = world_of("demo", seed=5), world_of("demo", seed=5)

    for _ in zip(run(one, 20.0), run(other, 20.0), strict=True):
        pass

    for robot_id in FLEET:
        assert one.rigs[robot_id].odometry() == other.rigs[robot_id].odometry()
    assert one.discs() == other.discs()


def test_a_scan_shows_the_laser_of_the_profile_with_720_beams() -> None:
    world = world_of("demo")

    scan = world.rigs["AGI"].scan(world)

    assert scan.ranges.size == 720
    assert scan.angle_min == -math.pi
    assert scan.angle_increment * 720 == pytest.approx(math.tau)
    assert scan.range_max == 30.0


def test_hidden_and_false_people_are_what_the_camera_is_told() -> None:
    world = world_of("nlos")
    rig = world.rigs["AGI"]

    rig.hides_people = True
    assert rig.detect(0.0, world).detections == ()

    rig.false_person = (12.0, 3.8)
    (ghost,) = rig.detect(10.0, world).detections
    assert ghost.class_id == PERSON
    assert ghost.box.centre[:2] == pytest.approx((0.0, -2.0), abs=1e-6)


def test_the_intent_names_task_goal_and_path() -> None:
    world = world_of("demo")
    navigation = world.rigs["AGII"].navigation()

    assert navigation.task == "hauling"
    assert navigation.goal == navigation.path[-1]
    assert len(navigation.path) == 12


def test_a_robot_that_is_not_commanded_stands() -> None:
    world = world_of("demo")
    rig = world.rigs["AGI"]

    rig.drive(Twist2D(0.0, 0.0))
    rig.move(0.5)

    assert rig.odometry().twist == Twist2D(0.0, 0.0)


def test_an_unknown_scenario_is_refused_with_the_known_ones() -> None:
    with pytest.raises(DataFileError, match="demo, nlos, nlos-field, coat, viewpoints"):
        scenario_named("nothing")


def test_a_greenhouse_without_room_for_the_fleet_is_refused() -> None:
    crowd = tuple(f"R{n}" for n in range(30))

    with pytest.raises(DataFileError, match="has room for 20 robots"):
        world_of("many", crowd)
    with pytest.raises(DataFileError, match="has 23 lanes, too few for 30"):
        world_of("many", crowd, load_greenhouse("agroconnect"))


def test_a_start_of_the_greenhouse_says_in_which_lane_a_robot_drives() -> None:
    greenhouse = load_greenhouse("agroconnect")
    world = world_of("demo", FLEET, greenhouse)
    lanes = set()

    for _ in run(world, 30.0):
        agi, agii = (world.rigs[robot_id].vehicle.pose for robot_id in FLEET)
        lanes.add(
            (greenhouse.lane_at(agi.x, agi.y), greenhouse.lane_at(agii.x, agii.y))
        )

    assert lanes == {("Pasillo 6 sur", "Pasillo central")}


def test_the_air_is_warm_at_two_in_the_afternoon_and_damp_at_night() -> None:
    day, night = climate_at(14 * 3600.0), climate_at(2 * 3600.0)

    assert (day.temperature, night.temperature) == (28.0, 16.0)
    assert (day.relative_humidity, night.relative_humidity) == (0.58, 0.82)
    assert (day.co2, night.co2) == (370.0, 490.0)
