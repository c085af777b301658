"""The server's own witness: what lasers see that nobody explains."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.alerts import conditions
from iveg.domain.detection_rule import DetectionRule
from iveg.domain.feedback import SpeedLimit
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.observations import LaserScan
from iveg.domain.rule.obstacles import CAUSE
from iveg.domain.tracking.tracker import MAX_PEOPLE, MAX_WALKERS
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep
from tests.builders import at, scan
from tests.unit.domain.scene import FIELD, Scene, person

AISLE = Greenhouse(
    "aisle",
    Rectangle(-40.0, -40.0, 40.0, 40.0),
    rows=(Rectangle(-30.0, 1.0, 30.0, 1.4), Rectangle(-30.0, -1.4, 30.0, -1.0)),
)
_MODEL = LaserModel()
_BEARINGS = -math.pi + _MODEL.angle_increment * np.arange(_MODEL.beams)


class Aisle(Scene):
    """AGI drives along an aisle with its laser; AGII stands far away.

    Attributes:
        rows: What really stands there.
    """

    rows = AISLE.rows

    def step(
        self,
        *people: tuple[float, float],
        x: float = 0.0,
        linear: float = 0.5,
        peer: tuple[float, float] = (-25.0, 0.0),
        seen: tuple[tuple[float, float], ...] = (),
    ) -> SpeedLimit:
        """A tenth of a second later, with everybody at their places."""
        self.now = round(self.now + 0.1, 6)
        self.drive("AGI", x, linear=linear)
        self.drive("AGII", *peer, linear=0.0)
        self.look("AGI", *(person(*one) for one in seen))
        self.look("AGII")
        self.scan("AGI", self.swept(x, people, peer))
        return self.judge()["AGI"]

    def swept(
        self,
        x: float,
        people: tuple[tuple[float, float], ...],
        peer: tuple[float, float],
    ) -> LaserScan:
        room = replace(AISLE, rows=self.rows)
        ranges = sweep(
            Pose2D(x, 0.0, 0.0),
            _MODEL,
            Scenery.of(room),
            [Disc(*one, 0.25) for one in people],
            [Body("AGII", Pose2D(*peer, 0.0), 1.0, 0.6)],
            np.random.default_rng(1),
        )
        said = scan("AGI", ranges, angle_min=-math.pi)
        return replace(said, angle_increment=_MODEL.angle_increment)


@pytest.fixture
def aisle() -> Aisle:
    return Aisle(greenhouse=AISLE)


def test_whom_only_a_laser_sees_slows_the_robot_after_a_fifth_of_a_second(
    aisle: Aisle,
) -> None:
    limits = [aisle.step((-1.8, 0.3)) for _ in range(4)]
    assert [one.speed_factor for one in limits] == [1.0, 1.0, 0.5, 0.5]
    assert (limits[-1].reason, limits[-1].cause) == ("obstacle", None)
    assert limits[-1].distance_m == pytest.approx(1.6, abs=0.1), "to its near side"
    (began,) = aisle.changes
    assert began.crossing.decision_id == limits[-1].decision_id
    assert began.crossing.in_sight


def test_it_is_let_go_a_second_after_the_laser_lost_it(aisle: Aisle) -> None:
    for _ in range(4):
        aisle.step((-1.8, 0.3))
    limits = [aisle.step().speed_factor for _ in range(16)]
    assert limits == [0.5] * 15 + [1.0]
    assert [one.began for one in aisle.changes] == [True, False]


def test_whom_a_camera_sees_has_a_ring_and_is_no_obstacle(aisle: Aisle) -> None:
    there = (-2.3, 0.2)
    limits = [aisle.step(there, seen=(there,)) for _ in range(5)]
    assert {one.reason for one in limits} == {"clear"}, "2.3 m behind base_link"
    for _ in range(3):
        limit = aisle.step(there, (1.9, 0.0), seen=(there,))
    assert limit.reason == "obstacle", "somebody else"


@pytest.mark.parametrize("off", [0.2, -0.2])
def test_a_plan_that_is_off_by_a_fifth_of_a_metre_stops_no_farm(
    aisle: Aisle, off: float
) -> None:
    aisle.rows = tuple(
        Rectangle(one.xmin, one.ymin + off, one.xmax, one.ymax + off)
        for one in AISLE.rows
    )
    limits = {aisle.step(x=0.08 * step, linear=0.8).reason for step in range(60)}
    assert limits == {"clear"}
    assert aisle.everyone == []


def test_a_peer_is_none(aisle: Aisle) -> None:
    assert {aisle.step(peer=(1.9, 0.0)).reason for _ in range(6)} == {"clear"}


def test_what_a_robot_will_reach_is_an_encounter_like_any_other(aisle: Aisle) -> None:
    blind = Aisle(greenhouse=AISLE, rule=DetectionRule(foresight=False))
    slow_at = [
        next(
            one
            for one in (0.08 * n for n in range(60))
            if scene.step((6.0, 0.0), x=one, linear=0.8).speed_factor < 1.0
        )
        for scene in (aisle, blind)
    ]
    ring_m = 6.0 - 0.25 - 2.0
    assert ring_m - slow_at[0] == pytest.approx(0.8 * 1.2, abs=0.2)
    assert slow_at[1] >= ring_m - 0.5 - 0.1, "from the outline of AGI on"
    foretold = aisle.speed_limits.foretold["AGI"][CAUSE]
    assert foretold.zone.reason == "obstacle"
    assert aisle.changes[0].crossing.foretold_s == pytest.approx(1.2, abs=0.1)


def test_where_no_plan_draws_what_stands_there_only_its_own_path_counts() -> None:
    bare = Aisle(greenhouse=FIELD)
    assert {bare.step().reason for _ in range(10)} == {"clear"}, "rows beside it"
    for _ in range(3):
        limit = bare.step((1.8, 0.0))
    assert limit.reason == "obstacle"


def test_a_person_is_a_graver_reason_than_an_obstacle(aisle: Aisle) -> None:
    for _ in range(4):
        limit = aisle.step((1.5, 0.0), (-1.6, 0.0), seen=((1.5, 0.0),))
    assert limit.reason == "person"
    assert len(aisle.changes) == 2


# --- who walks ------------------------------------------------------------------------


def walk(aisle: Aisle, steps: int, *, seen: bool = False) -> tuple[float, float]:
    """Somebody walks towards AGI from behind at 1 m/s; returns where they end."""
    place = (-2.3, 0.2)
    for _ in range(steps):
        place = (place[0] + 0.1, 0.2)
        aisle.step(place, linear=0.0, seen=(place,) if seen else ())
    return place


def test_who_walks_near_a_robot_is_possibly_a_person_whose_ring_others_get(
    aisle: Aisle,
) -> None:
    x, _ = walk(aisle, 8)
    (one,) = aisle.everyone
    assert (one.class_, one.newest.class_id, one.newest.laser) == (
        "person",
        "laser",
        True,
    )
    assert one.newest.x == pytest.approx(x, abs=0.3)
    assert one.newest.vx > 0.1
    aisle.drive("AGII", x - 1.5, linear=0.5)
    limit = aisle.judge()["AGII"]
    assert (limit.speed_factor, limit.reason, limit.cause) == (
        0.5,
        "person",
        one.person_id,
    )


def test_who_stops_before_the_laser_is_still_somebody_for_ten_seconds(
    aisle: Aisle,
) -> None:
    place = walk(aisle, 8)
    seen = list[float]()
    for _ in range(120):
        aisle.step(place, linear=0.0)
        (one,) = aisle.everyone
        seen.append(one.age_s(at(aisle.now)))
    assert max(seen[:95]) < 0.2
    assert seen[-1] > 1.0
    assert aisle.judge()["AGI"].reason == "person", "its ring lasts a little longer"


def test_who_walked_beside_a_robot_is_seen_on_as_it_drives_away(aisle: Aisle) -> None:
    x, y = walk(aisle, 8)
    for step in range(40):
        x -= 0.08
        aisle.step((x, y), x=0.08 * step, linear=0.8)
        (one,) = aisle.everyone
        assert one.age_s(at(aisle.now)) < 0.2
        assert one.newest.x == pytest.approx(x, abs=0.3)
    assert 0.08 * 39 - x > 5.0, "beyond what it looks at for anybody else"


def test_where_two_may_be_who_walked_neither_is_and_who_did_is_remembered(
    aisle: Aisle,
) -> None:
    x, y = walk(aisle, 8)
    for step in range(40):
        aisle.step((x - 0.08 * step, y), x=0.08 * step, linear=0.8)
    x -= 0.08 * 39
    before = aisle.everyone
    for step in range(40, 50):
        two = (x, y), (x, y - 0.8)
        aisle.step(*two, x=0.08 * step, linear=0.8)
    (one,) = before
    assert aisle.people.known[one.person_id].age_s(at(aisle.now)) > 0.8


def test_whom_a_camera_then_confirms_keeps_the_name_and_has_no_second_one(
    aisle: Aisle,
) -> None:
    walk(aisle, 8)
    (before,) = aisle.everyone
    place = (-1.4, 0.2)
    for _ in range(5):
        aisle.step(place, linear=0.0, seen=(place,))
    (after,) = aisle.everyone
    assert after.person_id == before.person_id
    assert after.newest.class_id == "farmer"
    assert len(after.sightings) == 2, "what a camera sees is a chain of its own"
    aisle.now += 3.0
    (ring,) = after.rings(aisle.rule, at(aisle.now))
    assert not ring[0].laser, "what only a laser saw is forgotten sooner"


def test_whom_a_camera_saw_first_is_no_second_person_to_the_laser(aisle: Aisle) -> None:
    walk(aisle, 12, seen=True)
    (one,) = aisle.everyone
    assert {look.laser for look in one.sightings} == {False}


def test_what_goes_with_the_robot_or_stands_is_no_person(aisle: Aisle) -> None:
    for step in range(40):
        x = 0.06 * step
        aisle.step((x - 1.4, 0.0), (4.0, 0.3), x=x, linear=0.6)
    assert aisle.everyone == []
    assert aisle.judge()["AGI"].reason == "obstacle"


def test_what_sways_is_no_person(aisle: Aisle) -> None:
    for step in range(40):
        aisle.step((-1.6 + 0.4 * (step // 4 % 2), 0.0), linear=0.0)
    assert aisle.everyone == []


def test_what_a_robot_swings_round_as_it_turns_is_no_person() -> None:
    field = Aisle(greenhouse=AISLE)
    for step in range(30):
        field.now = round(field.now + 0.1, 6)
        yaw = 0.1 * step
        field.drive("AGI", 0.0, 20.0, yaw, linear=0.0)
        ranges = np.where(np.abs(_BEARINGS - 0.5) < 0.2, 1.2, np.inf)
        said = scan("AGI", ranges, angle_min=-math.pi)
        field.scan("AGI", replace(said, angle_increment=_MODEL.angle_increment))
    assert field.everyone == []
    assert field.judge()["AGI"].reason != "clear"


def test_a_wall_that_nobody_drew_does_not_walk(aisle: Aisle) -> None:
    aisle.rows = (*AISLE.rows, Rectangle(1.0, 0.5, 9.0, 0.55))
    for step in range(80):
        aisle.step(x=0.08 * step, linear=0.8)
    assert aisle.everyone == []


def test_no_more_than_32_are_kept_beside_those_whom_cameras_see() -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    robot = scene.world.robot("AGI")
    for number in range(40):
        scene.people.witness(robot, [(7.0 * number, 0.0)], at(0.0), f"w{number}")
    assert len(scene.everyone) == MAX_WALKERS
    scene.look("AGI", *(person(7.0 * n, 50.0) for n in range(MAX_PEOPLE)))
    assert len(scene.everyone) == MAX_WALKERS + MAX_PEOPLE


# --- lasers that are no witness -------------------------------------------------------


def faults(mount_yaw: float, ranges: float | None, seconds: int) -> list[str]:
    """The alerts of a laser that sweeps an aisle, or always measures the same."""
    aisle, here = Aisle(greenhouse=AISLE), Pose2D(0.0, 0.0, mount_yaw)
    far_away = (-25.0, 0.0)
    for _ in range(10 * seconds):
        aisle.now = round(aisle.now + 0.1, 6)
        aisle.drive("AGI", 0.0)
        said = aisle.swept(0.0, (), far_away)
        if ranges is not None:
            said = replace(said, ranges=np.full_like(said.ranges, ranges))
        aisle.scan("AGI", replace(said, mount=here))
    fault = aisle.obstacles.fault("AGI", at(aisle.now))
    return [one.key for one in conditions.of_laser("AGI", fault)]


@pytest.mark.parametrize(
    ("mount_yaw", "ranges", "told"),
    [
        (0.0, None, []),
        (math.pi / 2, None, ["alert.laser_unfit"]),
        (0.0, 0.0, ["alert.laser_blind"]),
        (0.0, math.inf, ["alert.laser_blind"]),
        (0.0, 0.7, ["alert.laser_unfit"]),
    ],
)
def test_a_laser_that_is_no_witness_is_told(
    mount_yaw: float, ranges: float | None, told: list[str]
) -> None:
    assert faults(mount_yaw, ranges, 8) == told
    assert faults(mount_yaw, ranges, 4) == [], "not for a moment"
