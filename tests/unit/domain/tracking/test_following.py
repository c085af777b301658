"""The laser of a robot follows whom its camera lost (docs/safety.md, "The laser")."""

import math
from collections.abc import Callable, Sequence
from itertools import count
from typing import Any

import numpy as np
import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.observations import LaserScan
from iveg.domain.rule.neighbours import Neighbours
from iveg.domain.rule.zones import zones_of
from iveg.domain.tracking.laser_sight import LaserSight
from iveg.domain.tracking.person import Followed, Sighting
from iveg.lab.emulator.greenhouse import Disc, Scenery
from iveg.lab.emulator.lidar import sweep
from tests.builders import at, detection
from tests.unit.domain.scene import Scene
from tests.unit.domain.tracking.test_laser_sight import HERE, MODEL, PLAN, ROOM, read

Place = tuple[float, float]
Goes = Callable[[float], Place]
SPOT = (-2.5, 0.3)
FAR = (5.0, 0.0)
_TURNS = count()


def _stays(_: float) -> Place:
    return SPOT


def _walks(after_s: float) -> Place:
    return SPOT[0] + 0.9 * after_s, SPOT[1] + 0.3 * after_s


def scan_of(*people: Place, radius: float = 0.25) -> LaserScan:
    discs, rng = [Disc(*one, radius) for one in people], np.random.default_rng
    noise = rng(next(_TURNS))
    return read(sweep(HERE, MODEL, Scenery.of(ROOM), discs, [], noise))


def scene_after(
    seconds: float,
    goes: Goes = _stays,
    *,
    others: Sequence[Place] = (),
    hidden_s: tuple[float, float] = (0.0, 0.0),
    radius: float = 0.25,
    boxes: Sequence[Place] = (SPOT,),
    class_id: str = "person",
    swept_by: str = "AGI",
    peer: Place = FAR,
) -> Scene:
    """AGI's camera sees somebody once, then a laser sweeps for a while."""
    scene, scan = Scene(greenhouse=ROOM), [scan_of()]
    scene.all_clear = LaserSight(PLAN, lambda _: scan[0]).all_clear()
    scene.drive("AGI", 0.0, linear=0.0)
    scene.look("AGI", *(detection(class_id, *one) for one in boxes))
    for step in range(1, round(10 * seconds) + 1):
        scene.now = step / 10
        is_seen = not hidden_s[0] <= scene.now < hidden_s[1]
        there = [goes(scene.now)] if is_seen else []
        scan[0] = scan_of(*there, *others, radius=radius)
        scene.drive("AGI", 0.0, linear=0.0)
        scene.drive("AGII", *peer, linear=0.0)
        robot = scene.world.robot(swept_by)
        robot.scan_pose, robot.scan_received = HERE, at(scene.now)
        scene.sweep()
    return scene


def ring_after(seconds: float, *goes: Goes, **options: Any) -> tuple[Sighting, float]:
    """The ring of that look, which is nothing else than before."""
    scene = scene_after(seconds, *goes, **options)
    person = scene.everyone[0]
    assert person.observers(at(scene.now)) == (["AGI"] if scene.now <= 1.0 else [])
    ((sighting, ring_m),) = person.rings(scene.rule, at(scene.now))
    assert sighting.at == at(0.0)
    assert (sighting.x, sighting.y) == pytest.approx(SPOT)
    assert person.newest is sighting
    return sighting, ring_m


def is_followed(seconds: float = 2.0, **options: Any) -> bool:
    return ring_after(seconds, **options)[0].followed is not None


@pytest.mark.parametrize("goes", [_stays, _walks])
def test_a_ring_is_where_the_laser_has_whom_the_camera_lost(goes: Goes) -> None:
    sighting, ring_m = ring_after(3.0, goes)
    assert math.dist(sighting.place, goes(3.0)) < 0.1
    # As wide as of somebody who was in sight a second ago, not three.
    assert ring_m == pytest.approx(2.0 + 1.6 * 0.68)


def test_robots_are_slowed_and_told_where_it_is() -> None:
    scene = scene_after(3.0, _walks)
    (look,) = scene.everyone[0].sightings
    zones = zones_of(scene.world, scene.people, scene.rule, at(scene.now))
    (zone,) = (one for one in zones if one.reason == "person")
    near = Neighbours.of(scene.world, scene.people, scene.rule, at(scene.now))
    assert (zone.x, zone.y) == look.place
    assert math.dist(look.place, SPOT) > 2.0
    assert zone.cause in near.causes["AGI"]


def test_it_grows_as_soon_as_the_laser_loses_them() -> None:
    sighting, ring_m = ring_after(3.0, hidden_s=(2.05, 9.0))
    assert math.dist(sighting.place, SPOT) < 0.1
    assert ring_m == pytest.approx(2.0 + 1.6 * (0.68 + 1.0))


def test_a_ring_is_never_wider_than_if_nobody_had_followed() -> None:
    rule, seen = DetectionRule(), Sighting("AGI", 0.0, 0.0, 1.0, at(0.0), "person", 0.9)
    for since in (0.0, 0.5, 1.0, 4.0):
        followed = seen.followed_to(Followed(1.0, 0.0, since))
        for age_s in (since, since + 0.5, since + 3.0):
            now = at(age_s)
            plain, moved = seen.ring_age_s(now), followed.ring_age_s(now)
            assert rule.radius_at(moved) <= rule.radius_at(plain)


def test_it_takes_a_second_in_sight_of_the_laser() -> None:
    assert not is_followed(1.0)
    assert is_followed(1.2)


def test_a_new_look_of_the_camera_begins_anew() -> None:
    sighting = ring_after(2.0)[0]
    assert sighting.followed is not None
    assert sighting.in_chain(sighting.chain, sighting).followed is None


@pytest.mark.parametrize(
    ("options", "is_plain"),
    [
        ({}, True),
        # Somebody else stands beside them, or far away.
        ({"others": [(-2.5, -0.85)]}, False),
        ({"others": [(-2.5, 0.85)]}, False),
        ({"others": [(-4.5, 0.3)]}, True),
        # For one sweep the laser does not see them.
        ({"hidden_s": (0.55, 0.65)}, False),
        # It saw nobody when the camera did; what it saw was elsewhere, or a tip.
        ({"hidden_s": (0.0, 0.65)}, False),
        ({"goes": lambda _: (-0.6, 0.3)}, False),
        ({"radius": 0.05}, False),
        # The camera saw two, beside each other and not.
        ({"boxes": [SPOT, (-2.5, -1.0)]}, False),
        ({"boxes": [SPOT, (3.0, 0.0)]}, True),
        # No person; no laser of the robot that saw them; a peer close by.
        ({"class_id": "husky"}, False),
        ({"swept_by": "AGII"}, False),
        ({"peer": (-3.5, 0.0)}, False),
    ],
)
def test_it_has_to_be_plain_who_that_is(
    options: dict[str, Any], is_plain: bool
) -> None:
    assert is_followed(2.0, **options) is is_plain
