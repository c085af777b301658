"""What becomes "known here" by itself, and what ends it (docs/safety.md)."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.known import KnownPlace
from iveg.domain.observations import LaserScan
from iveg.domain.obstacle import Body, Obstacle
from iveg.domain.rule import known_here
from iveg.domain.rule.known_here import (
    MOST_KNOWN,
    MOST_SPOTS,
    Around,
    KnownHere,
    Somebody,
)
from iveg.domain.tracking.things import Thing, Things
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.lidar import LaserModel, sweep
from tests.builders import at, scan
from tests.unit.domain.rule.test_obstacles import AISLE
from tests.unit.domain.scene import Scene, person

_MODEL = LaserModel()
TIP = (0.0, 0.58)
"""0.42 m from the row beside it."""
HERE = Pose2D(0.0, 0.0, 0.0)


def seen(
    x: float = 0.0,
    y: float = 0.56,
    *,
    beside: tuple[float, float] = (0.0, 0.5),
    out_m: float = 0.45,
    size_m: float = 0.1,
    way_m: float = 0.0,
) -> Obstacle:
    """Something that a laser has seen for 0.3 s."""
    half = size_m / 2
    box = Rectangle(x - half, y - half, x + half, y + half)
    first = Obstacle.new(Body(x, y, size_m, 0.3, beside, box, out_m), 0.0)
    return replace(first, at=0.3, most_way_m=way_m)


class Visits:
    """Robots pass a place again and again."""

    def __init__(self) -> None:
        self.things = Things()
        self.known = KnownHere(self.things)

    def pass_by(
        self,
        *times: float,
        ahead: tuple[float, ...] = (0.6, 0.0),
        one: Obstacle | None = None,
    ) -> bool:
        """Two looks at it at each time (s); returns whether it is known then."""
        for time in times:
            for x in ahead:
                look = replace(one or seen(), beside=(x, 0.5))
                self.known.learn("AGI", [look], at(time))
        return self.is_known

    @property
    def is_known(self) -> bool:
        return any(True for _ in self.known.known)


TEN_MINUTES = (0.0, 200.0, 400.0, 601.0)


def test_what_is_seen_at_each_visit_of_ten_minutes_is_known() -> None:
    visits = Visits()
    assert not visits.pass_by(*TEN_MINUTES[:-1])
    assert visits.pass_by(TEN_MINUTES[-1])
    (spot,) = visits.known.known
    assert spot.known_since == at(601.0)


def test_less_than_ten_minutes_or_three_visits_are_too_few() -> None:
    assert not Visits().pass_by(0.0, 200.0, 400.0, 599.0)
    assert not Visits().pass_by(0.0, 5.0, 601.0, 606.0)


def test_what_moves_with_a_robot_is_never_known() -> None:
    assert not Visits().pass_by(*TEN_MINUTES, ahead=(0.3, 0.4))


@pytest.mark.parametrize(
    "one",
    [seen(out_m=0.51), seen(size_m=0.6), seen(way_m=0.3)],
    ids=["in the aisle", "large", "stirs"],
)
def test_what_may_be_somebody_is_not_learnt(one: Obstacle) -> None:
    assert not Visits().pass_by(*TEN_MINUTES, one=one)


def around(time: float, x: float | None = None, person_id: str | None = "P1") -> Around:
    """Who is on the map, and was seen at this time."""
    if x is None:
        return Around()
    return Around([Somebody(person_id, time, (x, 0.56))])


def test_whoever_passes_in_view_only_interrupts() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    for time, x, told in ((610.0, 1.1, 1), (611.0, 0.9, 0), (612.0, -1.1, 1)):
        visits.known.watch(around(time, x), at(time))
        assert len(visits.known.near("AGI", HERE, at(time))) == told


def test_nothing_counts_while_somebody_is_near() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES[:-1])
    visits.known.watch(around(601.0, 0.9), at(601.0))
    assert not visits.pass_by(601.0)
    visits.known.watch(around(602.0, 1.1), at(602.0))
    assert visits.pass_by(602.0)


def test_while_a_faint_box_shows_somebody_nothing_counts() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES[:-1])
    visits.known.watch(around(601.0, 0.9, None), at(601.0))
    assert not visits.pass_by(601.0)
    visits.known.watch(around(601.0), at(602.0))
    assert visits.pass_by(602.0)


@pytest.mark.parametrize(
    "later",
    [around(650.0), around(650.0, 5.0), around(650.0, 0.9, "P2")],
    ids=["forgotten", "seen elsewhere much later", "another came"],
)
def test_who_was_lost_there_begins_the_time_anew(later: Around) -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    visits.known.watch(around(610.0, 0.9), at(610.0))
    visits.known.watch(around(610.0, 0.9), at(640.0))
    assert visits.is_known
    visits.known.watch(later, at(650.0))
    assert not visits.is_known


def test_what_moves_to_it_begins_the_time_anew() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    come = replace(seen(0.1, way_m=0.5), first_x=0.6)
    visits.known.stir([come], at(610.0))
    assert visits.is_known, "it may be somebody who walks by"
    visits.known.stir([replace(come, at=1.0)], at(610.7))
    assert not visits.is_known


def test_where_something_begins_to_move_it_has_to_be_seen_again() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    visits.known.stir([replace(seen(0.5, way_m=0.5), first_x=0.0)], at(610.0))
    visits.known.watch(Around(), at(620.0))
    assert visits.known.near("AGI", HERE, at(620.0)) == ()
    visits.pass_by(621.0)
    visits.known.watch(Around(), at(621.0))
    assert len(visits.known.near("AGI", HERE, at(621.0))) == 1


def test_what_moves_beside_it_only_interrupts() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    visits.known.watch(Around(moving=[seen(0.8, way_m=0.5)]), at(610.0))
    assert visits.known.near("AGI", HERE, at(610.0)) == ()
    visits.known.watch(Around(), at(611.5))
    assert len(visits.known.near("AGI", HERE, at(611.5))) == 1


def test_a_place_that_is_seen_empty_for_three_seconds_is_known_no_more() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    for time, passes in ((1, True), (2, False), (3, True), (4, True), (5, True)):
        visits.known.swept("AGI", lambda *_, says=passes: says, HERE, at(610.0 + time))
        assert visits.is_known
    visits.known.swept("AGII", lambda *_: True, HERE, at(616.0))
    assert visits.is_known, "one robot has to see it for so long"
    visits.known.swept("AGI", lambda *_: True, HERE, at(616.0))
    assert not visits.is_known


def test_who_is_far_away_sees_no_place_empty() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    for time in range(9):
        far = Pose2D(5.0, 0.0, 0.0)
        visits.known.swept("AGI", lambda *_: True, far, at(610.0 + time))
    assert visits.is_known


def test_what_nobody_saw_for_an_hour_is_forgotten() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    visits.known.watch(Around(), at(4200.0))
    assert visits.is_known
    visits.known.watch(Around(), at(4202.0))
    assert not visits.is_known


def test_a_robot_is_told_of_what_is_near_while_somebody_watches() -> None:
    visits = Visits()
    visits.pass_by(*TEN_MINUTES)
    visits.known.watch(Around(), at(601.0))
    (place,) = visits.known.near("AGI", HERE, at(601.5))
    assert (place.radius_m, place.most_out_m) == (0.3, 0.5)
    assert visits.known.near("AGII", Pose2D(8.1, 0.56, 0.0), at(601.5)) == ()
    assert visits.known.near("AGI", HERE, at(602.1)) == (), "nobody watches any more"


def test_there_are_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(known_here, "LEARNS_S", 0.0)
    monkeypatch.setattr(known_here, "LEAST_VISITS", 1)
    visits = Visits()
    for number in range(MOST_SPOTS + 50):
        for ahead in (0.6, 0.0):
            one = seen(float(number), beside=(ahead, 0.5))
            visits.known.learn("AGI", [one], at(float(number)))
    visits.known.watch(Around(), at(1050.0))
    assert len(list(visits.known.known)) == MOST_KNOWN
    assert len(visits.known.near("AGI", Pose2D(100.0, 0.0, 0.0), at(1050.0))) <= 32


def marked(visits: Visits) -> Thing:
    thing = Thing("T1", 3.0, 0.0, "ana", at(0.0), at(900.0), "obstacle")
    visits.things.add(thing)
    return thing


def test_a_mark_of_an_operator_is_told_at_once_until_its_time_is_up() -> None:
    visits = Visits()
    marked(visits)
    for time in (1.0, 899.5, 900.5):
        visits.known.watch(Around(), at(time))
        told = visits.known.near("AGI", HERE, at(time))
        assert told == ((KnownPlace(3.0, 0.0, 0.5),) if time < 900.0 else ())


def test_somebody_in_its_circle_ends_a_mark_and_whoever_passes_does_not() -> None:
    visits = Visits()
    thing = marked(visits)
    visits.known.watch(Around(present=[(3.6, 0.0)]), at(1.0))
    assert list(visits.things.end(at(1.0))) == []
    visits.known.watch(Around(present=[(3.4, 0.0)]), at(2.0))
    assert visits.known.near("AGI", HERE, at(2.0)) == ()
    assert list(visits.things.end(at(2.0))) == [thing]
    assert visits.things.all == []


def test_a_marked_thing_that_went_ends_its_mark() -> None:
    visits = Visits()
    thing = marked(visits)
    for time in range(5):
        visits.known.swept("AGI", lambda *_: True, HERE, at(float(time)))
    assert list(visits.things.end(at(5.0))) == [thing]


class Plants(Scene):
    """AGI drives along an aisle in which the tip of a plant leans out.

    Attributes:
        tips: Where they are.
        mount: Of its laser, as it says.
        ghost: Something beside the robot that goes with it, in ``base_link``.
    """

    tips: tuple[tuple[float, float], ...] = (TIP,)
    mount = HERE
    ghost: tuple[float, float] | None = None

    def sweep_at(
        self, x: float, *people: tuple[float, float], turned: float = 0.0
    ) -> str:
        """A tenth of a second later; returns why AGI is limited."""
        self.now = round(self.now + 0.1, 6)
        self.drive("AGI", x, linear=0.8)
        self.drive("AGII", -25.0, linear=0.0)
        self.look("AGI")
        self.look("AGII")
        discs = [Disc(*one, 0.05) for one in self.tips]
        discs += [Disc(*one, 0.25) for one in people]
        if self.ghost is not None:
            discs.append(Disc(x + self.ghost[0], self.ghost[1], 0.05))
        ranges = sweep(
            Pose2D(x, 0.0, turned),
            _MODEL,
            Scenery.of(AISLE),
            discs,
            [],
            np.random.default_rng(round(self.now * 10)),
        )
        self.scan("AGI", self.said(ranges))
        return self.judge()["AGI"].reason

    def said(
        self, ranges: np.ndarray[tuple[int, ...], np.dtype[np.float32]]
    ) -> LaserScan:
        told = scan("AGI", ranges, angle_min=-math.pi)
        step = _MODEL.angle_increment
        return replace(told, angle_increment=step, mount=self.mount)

    def pass_by(self, *people: tuple[float, float], turned: float = 0.0) -> set[str]:
        """Drive past it; returns why AGI was limited, but for what was before."""
        self.now += 110.0
        ways = np.arange(-2.8, 1.6, 0.08).tolist()
        told = [self.sweep_at(x, *people, turned=turned) for x in ways]
        return set(told[15:])

    @property
    def known(self) -> int:
        return sum(1 for _ in self.obstacles.known_here.known)


def plants(**differs: object) -> Plants:
    one = Plants(greenhouse=AISLE)
    for name, value in differs.items():
        setattr(one, name, value)
    return one


def test_a_plant_that_leans_out_slows_robots_for_ten_minutes() -> None:
    scene = plants()
    told = [scene.pass_by() for _ in range(8)]
    assert all("obstacle" in one for one in told[:6]), "it is not in the plan"
    assert told[-1] == {"clear"}
    assert scene.known == 1


def test_who_walks_there_slows_them_as_ever() -> None:
    scene = plants()
    for _ in range(8):
        scene.pass_by()
    assert scene.known == 1
    scene.now += 100.0
    reasons = [scene.sweep_at(-1.0, (1.2 - 0.1 * n, 0.3)) for n in range(24)]
    assert {"obstacle", "person"} & set(reasons)


def test_who_stands_in_front_of_it_slows_them_as_ever() -> None:
    scene = plants()
    for _ in range(8):
        scene.pass_by()
    assert "obstacle" in scene.pass_by((0.0, 0.4))


@pytest.mark.parametrize(
    "differs",
    [
        {"mount": Pose2D(0.0, 0.0, 0.5)},
        {"tips": (), "ghost": (0.3, 0.56)},
        {"tips": ((0.0, 0.3),)},
    ],
    ids=["a wrong mount", "a ghost that goes along", "in the aisle"],
)
def test_nothing_else_is_learnt(differs: dict[str, object]) -> None:
    scene = plants(**differs)
    for _ in range(9):
        scene.pass_by()
    assert scene.known == 0


def test_zeros_teach_nothing_and_end_nothing() -> None:
    scene = plants()
    for _ in range(8):
        scene.pass_by()
    for _ in range(60):
        scene.now = round(scene.now + 0.1, 6)
        scene.drive("AGI", 0.0)
        scene.scan("AGI", scene.said(np.zeros(_MODEL.beams, np.float32)))
    assert scene.known == 1


def test_where_somebody_was_seen_last_nothing_is_learnt() -> None:
    scene = plants()
    for _ in range(30):
        scene.now = round(scene.now + 0.1, 6)
        scene.drive("AGI", -2.0)
        scene.look("AGI", person(0.5, 0.5))
    for _ in range(8):
        scene.pass_by()
    assert scene.known == 0, "not before they are forgotten, ten minutes later"
