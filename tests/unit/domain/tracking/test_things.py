"""Things that an operator calls "not a person here", and whom they never hide."""

import pytest

from iveg.domain.observations import Instant
from iveg.domain.tracking.things import Thing
from tests.builders import at
from tests.unit.domain.scene import Scene, machine, person

COAT = Thing("T1", 1.5, 0.0, "ana", at(0.0), at(100.0))


def marked() -> Scene:
    """AGI and AGII see each other; a coat hangs 1.5 m before AGI, and is marked."""
    scene = Scene()
    scene.people.things.known["T1"] = COAT
    for robot_id, x in (("AGI", 0.0), ("AGII", 9.0)):
        scene.drive(robot_id, x)
    scene.look("AGII")
    return scene


def see(scene: Scene, *boxes: tuple[float, float], speed: float = 0.5) -> None:
    """A picture a tenth of a second later: where people are (m), and how surely."""
    scene.now = round(scene.now + 0.1, 6)
    scene.drive("AGI", 0.0, linear=speed)
    scene.drive("AGII", 9.0, linear=speed)
    scene.look("AGII")
    scene.look("AGI", *(person(x, probability=confidence) for x, confidence in boxes))


def factor(scene: Scene) -> float:
    return scene.judge()["AGI"].speed_factor


def test_a_thing_slows_nobody_and_is_still_known() -> None:
    scene = marked()
    for _ in range(5):
        see(scene, (1.55, 0.85))

    assert factor(scene) == 1.0
    assert len(scene.everyone) == 1


def test_a_mark_frees_a_track_that_was_there_before() -> None:
    scene = marked()
    scene.people.things.known.clear()
    see(scene, (1.5, 0.85))
    assert factor(scene) == 0.5

    scene.people.things.known["T1"] = COAT
    for _ in range(12):
        see(scene, (1.5, 0.85), speed=0.0)
        last = factor(scene)

    assert last == 1.0


@pytest.mark.parametrize("x", [2.01, 1.5], ids=["outside", "surely seen"])
def test_who_is_outside_or_surely_seen_is_no_thing(x: float) -> None:
    scene = marked()
    see(scene, (x, 0.95))

    assert factor(scene) == 0.5


def test_a_robot_and_somebody_beyond_the_walls_are_no_things() -> None:
    scene = marked()
    scene.look("AGI", machine(1.5))

    assert scene.judge()["AGI"].reason == "robot"


@pytest.mark.parametrize(
    ("mono", "wall"), [(100.0, 0.0), (0.0, 100.0)], ids=["monotonic", "wall"]
)
def test_a_mark_ends_when_either_clock_says_so(mono: float, wall: float) -> None:
    scene = marked()
    now = Instant(mono=at(mono).mono, wall=at(wall).wall)

    see(scene, (1.5, 0.85))
    (coat,) = scene.everyone

    assert scene.people.things.explain(coat, at(99.9)) == COAT
    assert scene.people.things.explain(coat, now) is None
    assert not list(scene.people.things.end(at(99.9)))
    assert list(scene.people.things.end(now)) == [COAT]
    assert scene.people.things.known == {}
