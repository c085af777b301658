"""Faint people who are seen again and again, and people beyond the walls."""

from dataclasses import dataclass

import pytest

from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.tracking.people import People
from tests.builders import at
from tests.unit.domain.scene import Scene, person


def test_a_sure_box_ends_no_zone_of_a_weak_one() -> None:
    scene = Scene()
    for x, chance in ((5.0, 0.85), (5.0, 0.55), (5.5, 0.9)):
        scene.now += 0.3
        scene.drive("AGI", 0.0)
        scene.look("AGI", person(x, probability=chance))

    (somebody,) = scene.everyone
    found = {(one.x, one.possible) for one in somebody.sightings}
    assert found == {(5.0, True), (5.5, False)}


# --- beyond the walls -------------------------------------------------------------


@dataclass
class Walled(Scene):
    """A greenhouse of 20 × 20 m."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.people = People(Greenhouse("walled", Rectangle(0, 0, 20, 20)))
        self.drive("AGI", 10.0, 10.0)
        self.drive("AGII", 17.0, 10.0)


@pytest.mark.parametrize(("x", "is_doubtful"), [(-2.0, False), (-2.1, True)])
def test_two_metres_beyond_the_wall_a_position_is_doubtful(
    x: float, is_doubtful: bool
) -> None:
    scene = Walled()
    scene.look("AGI", person(x, 10.0))

    (somebody,) = scene.everyone
    assert (somebody.newest.reach_m > 0.0) is is_doubtful


def test_the_zone_of_a_doubtful_person_lies_round_who_saw_them() -> None:
    scene = Walled()
    scene.look("AGI", person(40.0, 10.0))

    speed_limits = scene.judge()

    assert speed_limits["AGI"].reason == "person"
    assert speed_limits["AGII"].reason == "person"
    ((look, radius),) = scene.everyone[0].zone_radii(scene.rule, at(scene.now))
    assert (look.x, look.y, radius) == (10.0, 10.0, 8.0)


def test_a_doubtful_person_takes_nobody_s_place() -> None:
    scene = Walled()
    scene.look("AGI", person(10.5, 10.0))
    scene.look("AGI", person(40.0, 10.0))
    scene.now = 0.1
    scene.look("AGI", person(10.6, 10.0))

    places = sorted((one.newest.reach_m > 0.0, one.newest.x) for one in scene.everyone)
    assert places == [(False, 10.6), (True, 10.0)]
