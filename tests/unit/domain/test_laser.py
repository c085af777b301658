"""Laser tracks of a robot (docs/safety.md, "The laser")."""

import math

import numpy as np
import pytest

from iveg.domain.geometry import REST, Pose2D, Rectangle, Twist2D
from iveg.domain.greenhouse import Greenhouse, PlacedObstacle, StructuralPost
from iveg.domain.laser import KnownPeer, LaserTracks, Outline, Plan
from iveg.domain.observations import LaserScan, Origin
from iveg.lab.emulator.greenhouse import Body, Disc, LaserModel, Scenery, sweep

ROOM = Greenhouse(
    "room",
    Rectangle(-20.0, -20.0, 20.0, 20.0),
    rows=(Rectangle(-10.0, 1.0, 10.0, 1.4), Rectangle(-10.0, -1.4, 10.0, -1.0)),
    posts=(StructuralPost(1.5, 0.8, 0.06),),
    obstacles=(PlacedObstacle("crates", Rectangle(-2.0, -0.9, -1.4, -0.3)),),
)
BODY = Outline(1.0, 0.7)
MODEL = LaserModel()
HERE = Pose2D(0.0, 0.0, 0.0)


class Beside:
    """A robot with its laser; ``plan`` is what it was told of the room."""

    def __init__(self, plan: Greenhouse | None = ROOM, room: Greenhouse = ROOM) -> None:
        self.room = room
        self.laser = LaserTracks(
            BODY, None if plan is None else Plan.from_greenhouse(plan)
        )
        self.now = 0.0
        self.peers_stand = True
        self.rng = np.random.default_rng(1)

    def look(
        self,
        *people: tuple[float, float],
        pose: Pose2D = HERE,
        believed: Pose2D | None = None,
        twist: Twist2D = REST,
        peers: tuple[Pose2D, ...] = (),
        leaves: np.random.Generator | None = None,
    ) -> bool:
        """A sweep a tenth of a second later; returns whether an obstacle counts."""
        self.now += 0.1
        ranges = sweep(
            pose,
            MODEL,
            Scenery.from_greenhouse(self.room, leaves),
            [Disc(x, y, 0.25) for x, y in people],
            [Body("P", one, 1.0, 0.7) for one in peers],
            self.rng,
        )
        self.hear(ranges, believed or pose, twist, peers)
        return self.laser.obstacle(self.now) is not None

    def hear(
        self,
        ranges: np.ndarray[tuple[int, ...], np.dtype[np.float32]],
        pose: Pose2D = HERE,
        twist: Twist2D = REST,
        peers: tuple[Pose2D, ...] = (),
    ) -> None:
        scan = LaserScan(
            "R", Origin(), -math.pi, MODEL.angle_increment, 0.1, 30.0, HERE, ranges
        )
        known = [KnownPeer(one, self.peers_stand) for one in peers]
        self.laser.look(scan, pose, twist, known, self.now)


@pytest.mark.parametrize("place", [(2.4, 0.0), (0.0, 0.65), (-1.5, 0.5), (2.2, -0.6)])
def test_a_person_within_two_metres_of_the_outline_counts_after_a_fifth_of_a_second(
    place: tuple[float, float],
) -> None:
    beside = Beside()
    assert not any(beside.look((3.1, 0.0)) for _ in range(20)), "farther away"
    assert [beside.look(place) for _ in range(4)] == [False, False, True, True]


def test_who_has_gone_counts_for_half_a_second_more() -> None:
    beside = Beside()
    assert [beside.look((2.0, 0.0)) for _ in range(3)][-1]
    assert [beside.look() for _ in range(6)] == [True] * 5 + [False]


def test_what_flashes_up_once_is_noise() -> None:
    beside = Beside()
    seen = [beside.look(*([(2.0, 0.0)] if n % 8 == 0 else [])) for n in range(40)]
    assert not any(seen)


@pytest.mark.parametrize(
    ("off", "leaning"),
    [
        (Pose2D(0.2, 0.0, 0.0), False),
        (Pose2D(0.0, -0.2, 0.02), False),
        (Pose2D(0.05, 0.1, 0.02), True),
        (Pose2D(0.05, -0.1, -0.02), True),
    ],
)
def test_nobody_stands_where_the_plan_is_off_or_plants_lean_out(
    off: Pose2D, leaning: bool
) -> None:
    beside = Beside()
    for step in range(60):
        pose = Pose2D(-6.0 + 0.2 * step, 0.0, 0.0)
        leaves = np.random.default_rng(7) if leaning else None
        assert not beside.look(pose=pose, believed=pose.compose(off), leaves=leaves)


@pytest.mark.parametrize("stands", [True, False])
def test_a_peer_is_nobody_and_a_person_beside_it_is(stands: bool) -> None:
    beside, peer = Beside(), Pose2D(1.8, 0.0, 0.0)
    beside.peers_stand = stands
    assert not any(beside.look(peers=(peer,)) for _ in range(20))
    assert [beside.look((0.4, -0.65), peers=(peer,)) for _ in range(3)][-1]


@pytest.mark.parametrize("stands", [True, False])
def test_who_is_close_to_a_peer_that_stands_is_no_part_of_it(stands: bool) -> None:
    beside, across = Beside(), Pose2D(1.8, 0.0, math.pi / 2)
    beside.peers_stand = stands
    seen = [beside.look((1.2, -0.45), peers=(across,)) for _ in range(3)]
    assert seen[-1] is stands


def test_what_is_larger_than_two_people_counts_once_it_moves() -> None:
    field = Greenhouse("field", ROOM.bounds)
    beside = Beside(field, field)

    def crowd(x: float) -> list[tuple[float, float]]:
        return [(x, 0.45 * n) for n in range(-3, 4)]

    assert not any(beside.look(*crowd(2.2)) for _ in range(10))
    assert any(beside.look(*crowd(2.2 - 0.1 * n)) for n in range(1, 8))


def test_without_a_plan_only_what_lies_on_its_own_path_counts() -> None:
    beside = Beside(plan=None)
    assert not any(beside.look((-2.0, 0.0)) for _ in range(10)), "behind it"
    assert [beside.look((2.0, 0.1)) for _ in range(3)][-1]


def test_a_spinning_robot_takes_no_row_for_a_person() -> None:
    beside, twist = Beside(), Twist2D(0.0, 1.0)
    for step in range(60):
        pose = Pose2D(0.0, 0.0, 0.1 * step)
        late = Pose2D(0.0, 0.0, 0.1 * step - 0.05)
        assert not beside.look(pose=pose, believed=late, twist=twist)


@pytest.mark.parametrize("value", [0.0, math.inf, 0.2, 1e9])
def test_a_scan_of_one_value_makes_nobody_up_and_hides_nobody_later(
    value: float,
) -> None:
    beside = Beside()
    beside.now += 0.1
    beside.hear(np.full(MODEL.beams, value, np.float32))
    assert [beside.look((2.0, 0.0)) for _ in range(3)][-1]
