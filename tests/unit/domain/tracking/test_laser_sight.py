"""A laser finds a spot empty only where nobody can be (docs/safety.md, "The laser")."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import LaserScan, Origin
from iveg.domain.tracking.laser_sight import LaserSight, swept_by, unexplained
from iveg.domain.witness import KnownBody, Plan
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep
from tests.builders import at
from tests.unit.domain.scene import Scene

ROOM = Greenhouse(
    "room",
    Rectangle(-8.0, -8.0, 8.0, 8.0),
    rows=(Rectangle(-6.0, 2.0, 6.0, 2.6), Rectangle(-6.0, -2.6, 6.0, -2.0)),
)
PLAN = Plan.of(ROOM)
STRANGE = partial(unexplained, plan=PLAN)
MODEL = LaserModel()
HERE = Pose2D(0.0, 0.0, 0.0)
SPOT = (-3.0, 0.5)


def scan_of(
    *people: tuple[float, float], pose: Pose2D = HERE, room: Greenhouse = ROOM
) -> LaserScan:
    """What the laser sees of a room with these people in it."""
    discs = [Disc(x, y, 0.25) for x, y in people]
    rng = np.random.default_rng(1)
    return read(sweep(pose, MODEL, Scenery.of(room), discs, [], rng))


def read(ranges: np.ndarray[tuple[int, ...], np.dtype[np.float32]]) -> LaserScan:
    return LaserScan(
        "AGI",
        Origin(),
        -math.pi,
        MODEL.angle_increment,
        MODEL.range_min,
        MODEL.range_max,
        HERE,
        ranges,
    )


def is_swept(
    scan: LaserScan,
    spot: tuple[float, float] = SPOT,
    *,
    pose: Pose2D = HERE,
    age_s: float = 1.5,
) -> bool:
    return swept_by(scan, pose, np.array([spot]), np.array([age_s]), STRANGE).size == 1


def test_beams_that_pass_find_a_spot_empty_wherever_the_robot_looks() -> None:
    for yaw in (0.0, 1.5, 3.0, -2.0):
        pose = Pose2D(0.0, 0.0, yaw)
        assert is_swept(scan_of(pose=pose), pose=pose)


@given(
    st.floats(-0.25, 0.25),
    st.floats(-0.25, 0.25),
    st.floats(-3.0, 3.0),
    st.floats(1, 9),
)
def test_nobody_who_is_about_the_spot_is_swept_away(
    dx: float, dy: float, yaw: float, age_s: float
) -> None:
    pose = Pose2D(0.0, 0.0, yaw)
    scan = scan_of((SPOT[0] + dx, SPOT[1] + dy), pose=pose)
    assert not is_swept(scan, pose=pose, age_s=age_s)


@given(st.floats(-4.0, 4.0), st.floats(-1.4, 1.4))
def test_who_may_have_walked_there_from_the_spot_keeps_the_ring(
    x: float, y: float
) -> None:
    """A second and a half at 1.6 m/s."""
    if math.hypot(x, y) < 1.0:
        return
    may = math.dist((x, y), SPOT) <= 0.3 + 1.6 * 1.5
    assert not may or not is_swept(scan_of((x, y)))


def test_who_cannot_have_come_from_the_spot_does_not_keep_it() -> None:
    assert is_swept(scan_of((3.0, 0.0)), age_s=1.5)
    assert not is_swept(scan_of((0.9, 0.5)), age_s=6.0)


def test_who_has_a_ring_by_now_keeps_no_second_one_where_they_were() -> None:
    scan, spots, ages = scan_of((0.9, 0.5)), np.array([SPOT]), np.array([6.0])
    assert not swept_by(scan, HERE, spots, ages, STRANGE).size
    there, elsewhere = KnownBody(0.9, 0.5, 0.6), KnownBody(0.9, -0.5, 0.6)
    assert swept_by(scan, HERE, spots, ages, STRANGE, [there]).size == 1
    assert not swept_by(scan, HERE, spots, ages, STRANGE, [elsewhere]).size


def test_who_leans_into_a_row_is_not_taken_for_the_row() -> None:
    """The plan explains all of them, but no beam passes."""
    assert not is_swept(scan_of((-3.0, 1.95)), (-3.0, 1.95))


def test_what_stands_before_a_spot_hides_it() -> None:
    assert not is_swept(scan_of((-1.5, 0.25)), age_s=0.1)
    assert not is_swept(scan_of(), (0.0, 4.0))


def test_a_spot_too_near_or_too_far_is_not_in_view() -> None:
    assert not is_swept(scan_of(), (0.3, 0.0))
    far = Pose2D(-7.0, 0.0, 0.0)
    assert not is_swept(scan_of(pose=far), (6.5, 0.0), pose=far)


@pytest.mark.parametrize("value", [math.inf, 0.0, 5.0, math.nan])
def test_a_laser_that_says_one_thing_everywhere_proves_nothing(value: float) -> None:
    assert not is_swept(read(np.full(MODEL.beams, value, np.float32)))


@pytest.mark.parametrize("increment", [0.0, 1e-12, 3.0])
def test_a_laser_with_too_many_or_too_few_beams_proves_nothing(
    increment: float,
) -> None:
    whole = scan_of()
    assert not is_swept(replace(whole, angle_increment=increment))


def test_a_beam_that_does_not_come_back_says_nothing() -> None:
    ranges = scan_of().ranges.copy()
    towards = math.atan2(SPOT[1], SPOT[0])
    ranges[round((towards + math.pi) / MODEL.angle_increment)] = math.inf
    assert not is_swept(read(ranges))


def test_a_sweep_that_ends_at_the_spot_does_not_pass_it() -> None:
    whole = scan_of()
    towards = math.atan2(SPOT[1], SPOT[0])
    first = round((towards + math.pi) / MODEL.angle_increment)
    begins = whole.angle_min + first * MODEL.angle_increment
    assert not is_swept(replace(whole, angle_min=begins, ranges=whole.ranges[first:]))


@pytest.mark.parametrize(
    "believed", [Pose2D(0.0, 0.0, 0.8), Pose2D(0.0, 1.5, 0.0), Pose2D(3.0, -1.0, 2.0)]
)
def test_a_laser_whose_walls_are_not_the_plans_proves_nothing(believed: Pose2D) -> None:
    """Frozen, turned on its mount, or of a robot that is elsewhere."""
    spots = [(0.5 * x, 0.5 * y) for x in range(-14, 15) for y in range(-14, 15)]
    everywhere, just_left = np.array(spots), np.zeros(len(spots))
    scan = scan_of()
    assert swept_by(scan, HERE, everywhere, just_left, STRANGE).size > 100
    assert swept_by(scan, believed, everywhere, just_left, STRANGE).size == 0


# --- by the newest scan of a robot ----------------------------------------------------


def scene_with_scan() -> Scene:
    scene = Scene(greenhouse=ROOM)
    scene.drive("AGI", 0.0, linear=0.0)
    robot = scene.world.robot("AGI")
    robot.scan, robot.scan_pose, robot.scan_received = scan_of(), HERE, at(scene.now)
    return scene


def sweeps(scene: Scene, sight: LaserSight | None = None) -> bool:
    sight = sight or LaserSight(PLAN, lambda _: scan_of())
    robot = scene.world.robot("AGI")
    spots, ages = np.array([SPOT]), np.array([1.5])
    return sight.swept(robot, spots, ages, (), at(scene.now)).size == 1


def test_the_newest_scan_of_a_live_robot_counts() -> None:
    assert sweeps(scene_with_scan())


def test_a_laser_that_repeats_itself_to_the_bit_finds_nothing_empty() -> None:
    one, other = scan_of(), scan_of()
    noisy = replace(one, ranges=one.ranges + np.float32(0.001))
    given = iter((one, one, other, other, noisy))
    scene, sight = scene_with_scan(), LaserSight(PLAN, lambda _: next(given))
    assert [sweeps(scene, sight) for _ in range(5)] == [True, True, False, False, True]


def test_one_scan_is_compared_with_the_plan_once_for_all_who_ask_it() -> None:
    asked = list[int]()

    class Counted(Plan):
        def distance_to(
            self, x: NDArray[np.float64], y: NDArray[np.float64]
        ) -> NDArray[np.float64]:
            asked.append(len(x))
            return Plan.distance_to(self, x, y)

    plan = Counted(PLAN.bounds, PLAN.rectangles, PLAN.posts)
    one, moved = scan_of(), replace(HERE, x=HERE.x + 0.01)
    scene, sight = scene_with_scan(), LaserSight(plan, lambda _: one)
    assert sweeps(scene, sight)
    assert sweeps(scene, sight)
    assert len(asked) == 1
    scene.world.robot("AGI").scan_pose = moved
    sweeps(scene, sight)
    assert len(asked) == 2


def test_an_old_scan_finds_nothing_empty() -> None:
    scene = scene_with_scan()
    scene.now = 0.6
    scene.drive("AGI", 0.0, linear=0.0)
    assert not sweeps(scene)


def test_a_robot_that_is_silent_or_contradicts_itself_finds_nothing_empty() -> None:
    silent, doubted = scene_with_scan(), scene_with_scan()
    silent.now = 0.45
    doubted.world.robot("AGI").doubts.contradicted("jump", at(0.0))
    assert sweeps(silent)
    assert not sweeps(doubted)
    silent.world.robot("AGI").scan_received = at(1.4)
    silent.now = 1.4
    assert not sweeps(silent)


def test_a_robot_without_a_scan_finds_nothing_empty() -> None:
    scene = Scene(greenhouse=ROOM)
    scene.drive("AGI", 0.0, linear=0.0)
    assert not sweeps(scene)
