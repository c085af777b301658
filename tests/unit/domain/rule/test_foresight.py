"""Encounters that can be calculated, and paths that nobody drives."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.geometry import Pose2D, Twist2D
from iveg.domain.observations import Odometry
from iveg.domain.parameters import ByClass
from iveg.domain.rule.foresight import Encounter, look_ahead
from iveg.domain.rule.zones import zones_of
from tests.builders import at, origin, received
from tests.unit.domain.scene import FIELD, Scene, person

MS_10 = 0.01


class Ahead:
    """AGI drives, AGII far away sees people; what is foretold of AGI."""

    def __init__(self, pose: Pose2D, twist: Twist2D) -> None:
        self.scene = Scene(greenhouse=FIELD)
        self.pose, self.twist = pose, twist
        self._seq = 100

    def see(self, *people: tuple[float, float]) -> "Ahead":
        """A picture of AGII, and where both robots are."""
        self._seq += 1
        stamp = origin(self._seq, after=self.scene.now)
        said = Odometry("AGI", stamp, self.pose, self.twist)
        self.scene.world.apply(received(said, after=self.scene.now))
        self.scene.drive("AGII", 50.0, linear=0.0)
        self.scene.look("AGII", *(person(x, y) for x, y in people))
        return self

    def walk(self, x: float, y: float, vx: float, vy: float) -> "Ahead":
        """Somebody walks for three seconds, and is at ``x``, ``y`` now."""
        for tenth in range(-30, 1):
            self.scene.now = 3.0 + tenth / 10
            self.see((x + vx * tenth / 10, y + vy * tenth / 10))
        return self

    def plan(self, *path: tuple[float, float]) -> "Ahead":
        self.scene.navigate("AGI", "work", path)
        return self

    def foretold(self, *, speed_before: float | None = None) -> Encounter | None:
        """The encounter of AGI, which drove so fast before it was slow (m/s)."""
        scene, now = self.scene, at(self.scene.now)
        zones = zones_of(scene.world, scene.people, scene.rule, now)
        before = {} if speed_before is None else {"AGI": speed_before}
        found = look_ahead(scene.world, zones, scene.rule, now, before)
        return next(iter(found.get("AGI", {}).values()), None)

    def must(self) -> Encounter:
        found = self.foretold()
        assert found is not None
        return found


@pytest.mark.parametrize("radius", [2.0, 3.0])
def test_straight_ahead_it_is_the_way_to_the_ring_by_the_speed(radius: float) -> None:
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(0.8, 0.0))
    ahead.scene.rule = DetectionRule(radius_m=ByClass(2.0, {"person": radius}))
    found = ahead.see((1.6 + radius, 0.0)).must()
    assert found.in_s == pytest.approx(1.6 / 0.8, abs=MS_10)
    assert (found.zone.cause, found.zone.radius_m) == ("P1", radius)


def test_reversing_it_is_behind() -> None:
    back = Twist2D(-0.5, 0.0)
    found = Ahead(Pose2D(0, 0, 0), back).see((-3.0, 0.0)).must()
    assert found.in_s == pytest.approx(2.0, abs=MS_10)
    assert Ahead(Pose2D(0, 0, 0), back).see((3.0, 0.0)).foretold() is None


@pytest.mark.parametrize("turn", [0.3, -0.3])
def test_on_an_arc_it_is_where_the_arc_meets_the_ring(turn: float) -> None:
    """Distance from a circle's point at angle a to a centre: solved by bisection."""
    speed, centre = 0.9, (3.2, 1.6 * math.copysign(1.0, turn))
    radius = speed / turn

    def apart(t: float) -> float:
        x, y = radius * math.sin(turn * t), radius * (1 - math.cos(turn * t))
        return math.hypot(centre[0] - x, centre[1] - y) - 2.0

    low, high = 0.0, 3.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if apart(middle) > 0.0 else (low, middle)
    found = Ahead(Pose2D(0, 0, 0), Twist2D(speed, turn)).see(centre).must()
    assert found.in_s == pytest.approx(low, abs=MS_10)


def test_two_who_walk_towards_each_other_meet_at_the_sum_of_their_speeds() -> None:
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(0.5, 0.0)).walk(5.0, 0.0, -1.0, 0.0)
    assert ahead.must().in_s == pytest.approx(3.0 / 1.5, abs=0.05)


@pytest.mark.parametrize(
    "walk",
    [(3.0, 0.0, 1.0, 0.0), (3.0, 2.5, 0.0, 1.2)],
    ids=["walks away", "crosses and is gone in time"],
)
def test_who_will_not_be_there_is_not_met(
    walk: tuple[float, float, float, float],
) -> None:
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(0.5, 0.0)).walk(*walk)
    assert ahead.foretold() is None


def test_a_robot_that_stands_or_is_there_already_meets_nobody() -> None:
    standing = Ahead(Pose2D(0, 0, 0), Twist2D(0.0, 0.0)).see((2.5, 0.0))
    assert standing.foretold() is None
    inside = Ahead(Pose2D(0, 0, 0), Twist2D(0.5, 0.0)).see((1.0, 0.0))
    assert inside.foretold() is None


def test_who_was_not_seen_for_a_second_has_a_ring_and_no_forecast() -> None:
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(0.8, 0.0)).see((3.6, 0.0))
    ahead.scene.now = 1.2
    assert ahead.see().foretold() is None


def test_of_a_slow_robot_it_is_told_whom_it_meets_once_it_is_let_go() -> None:
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(0.4, 0.0)).see((3.5, 0.0))
    assert ahead.foretold() is None, "3.75 s ahead"
    again = ahead.foretold(speed_before=0.8)
    assert again is not None
    assert again.effect == "holds"
    assert again.in_s == pytest.approx(1.5 / 0.8, abs=MS_10)
    now = ahead.see((3.0, 0.0)).foretold(speed_before=0.8)
    assert now == ahead.must(), "2.5 s ahead as it drives"


def test_its_own_plan_counts_before_the_arc_of_its_twist() -> None:
    corner = ((0.0, 0.0), (1.0, 0.0), (1.0, 9.0))
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(1.0, 0.0)).see((1.0, 4.0)).plan(*corner)
    assert ahead.must().in_s == pytest.approx(3.0, abs=0.05)
    turns = Ahead(Pose2D(0, 0, 0), Twist2D(1.0, 0.0)).see((4.0, 0.0)).plan(*corner)
    assert turns.foretold() is None, "it will have turned the corner"


@pytest.mark.parametrize(
    "path",
    [
        ((700.0, 0.0), (700.0, 9.0)),
        ((0.0, 0.0), (0.0, 0.0)),
        ((0.0, 3.0), (0.0, 9.0)),
        tuple((1e6 * (n % 2), float(n)) for n in range(100_000)),
    ],
    ids=["another frame", "one spot", "beside it", "100,000 that jump"],
)
def test_a_plan_that_it_does_not_drive_is_left_aside(
    path: tuple[tuple[float, float], ...],
) -> None:
    ahead = Ahead(Pose2D(0, 0, 0), Twist2D(0.8, 0.0)).see((3.6, 0.0)).plan(*path)
    found = ahead.foretold()
    assert found is None or 0.0 <= found.in_s <= 3.0
    if path[0] != (0.0, 0.0):
        assert found is not None
        assert found.in_s == pytest.approx(2.0, abs=MS_10)


# --- what it does to the limit ------------------------------------------------------


def _drive_towards(foresight: bool) -> list[tuple[float, float, float | None]]:
    """Speed limits of AGI on its way to somebody 6 m away: x, factor, foretold."""
    scene = Scene(rule=replace(DetectionRule(), foresight=foresight))
    told = []
    for tenth in range(60):
        scene.now = tenth / 10
        x = 0.08 * tenth
        scene.drive("AGI", x, linear=0.8)
        scene.drive("AGII", 50.0)
        scene.look("AGI")
        scene.look("AGII", person(6.0))
        limit = scene.judge()["AGI"]
        told.append((round(x, 2), limit.speed_factor, limit.foretold_s))
    return told


def test_a_robot_is_slowed_in_time_to_be_slow_at_the_ring_and_told_how_soon() -> None:
    told = _drive_towards(True)
    first = next(one for one in told if one[1] == 0.5)
    assert 2.5 <= first[0] <= 3.2, "the ring begins at 4.0"
    assert first[2] == pytest.approx((4.0 - first[0]) / 0.8, abs=0.2)
    assert next(one for one in _drive_towards(False) if one[1] == 0.5)[0] == 4.0
    assert {foretold for x, _, foretold in told if x >= 4.0} == {None}, "inside"


@pytest.mark.parametrize(("braking", "speed"), [(0.5, 1.0), (0.5, 1.5), (1.0, 1.0)])
def test_behind_somebody_who_walks_ahead_no_factor_lasts_less_than_two_seconds(
    braking: float, speed: float
) -> None:
    scene, x, drives = Scene(), 0.0, speed
    robot = scene.world.robot("AGI")
    profile = replace(robot.profile, braking=braking, max_speed=speed)
    robot.description = replace(robot.description, profile=profile)
    factors = []
    for tenth in range(200):
        scene.now = tenth / 10
        scene.drive("AGI", x, linear=drives)
        scene.drive("AGII", 50.0)
        scene.look("AGII")
        scene.look("AGI", person(4.5 + 0.7 * speed * scene.now))
        factors.append(scene.judge()["AGI"].speed_factor)
        gap = factors[-1] * speed - drives
        drives += min(0.05, max(-0.05 * braking, gap))
        x += drives * 0.1

    tenths = [n for n, (one, two) in enumerate(pairwise(factors)) if one != two]
    assert len(tenths) >= 2
    assert min(after - before for before, after in pairwise(tenths)) >= 20
