"""More than can be judged: who slows, until when, and that nobody known is dropped."""

import pytest

from iveg.domain.limits import LIMITS
from iveg.domain.rule.overload import PICTURES_HZ, Overload
from iveg.domain.tracking.tracker import MAX_PEOPLE
from tests.builders import at
from tests.unit.domain.scene import Scene, person

REACH_M = 8.0 + LIMITS.ring_most_m
"""Of AGI's camera, and beyond."""


def crowd(scene: Scene, count: int, *, first: int = 0) -> None:
    """AGI sees so many people, each far from the others, in one look."""
    numbers = range(first, first + count)
    scene.look("AGI", *(person(5.0 * (n % 60), 5.0 * (n // 60)) for n in numbers))


def full() -> Scene:
    scene = Scene()
    crowd(scene, MAX_PEOPLE)
    return scene


def test_whoever_has_a_ring_stays_when_more_come() -> None:
    scene = full()
    known = [one.person_id for one in scene.everyone]
    crowd(scene, 40, first=MAX_PEOPLE)
    assert [one.person_id for one in scene.everyone] == known
    assert scene.people.turned_away == 40


def test_somebody_known_is_seen_again_in_a_full_greenhouse() -> None:
    scene = full()
    scene.now = 0.5
    (placed,) = scene.look("AGI", person(0.2, 0.0))
    assert placed.person is not None
    assert placed.person.person_id == "P1"
    assert scene.people.turned_away == 0


def test_who_was_seen_once_long_ago_gives_way_and_who_was_seen_twice_never() -> None:
    scene = full()
    scene.now = 0.5
    scene.look("AGI", person(0.0))
    scene.now = LIMITS.ring_lasts_s + LIMITS.seen_s
    crowd(scene, 3, first=MAX_PEOPLE)
    left = {one.person_id for one in scene.everyone}
    assert {"P1", "P257", "P258", "P259"} <= left
    assert "P2" not in left
    assert len(left) <= MAX_PEOPLE
    assert scene.people.turned_away == 0


def test_forty_five_pictures_a_second_are_judged_and_no_more() -> None:
    overload = Overload()
    admitted = sum(overload.admits("AGI", at(n / 200)) for n in range(2000))
    assert admitted == pytest.approx(PICTURES_HZ * 11, abs=1)


def test_thirty_pictures_a_second_are_judged_for_ever() -> None:
    overload = Overload()
    assert all(overload.admits("AGI", at(n / 30)) for n in range(3000))


def fleet(*places: float, observer: str = "AGI") -> Scene:
    scene = Scene((observer, *(f"R{number}" for number in range(len(places)))))
    scene.drive("AGI", 0.0)
    for number, x in enumerate(places):
        scene.drive(f"R{number}", x)
        scene.look(f"R{number}")
    scene.look("AGI")
    return scene


def factors(scene: Scene) -> list[float]:
    return [speed_limit.speed_factor for speed_limit in scene.judge().values()]


def test_the_observer_and_who_is_within_its_sight_and_six_metres_drive_at_half() -> (
    None
):
    scene = fleet(REACH_M - 0.01, -REACH_M - 0.01, 60.0)
    scene.speed_limits.overload.judged("AGI", at(0.0), whole=False)
    assert factors(scene) == [0.5, 0.5, 1.0, 1.0]


def test_in_an_open_field_it_is_the_whole_fleet() -> None:
    scene = fleet(60.0)
    open_field = scene.speed_limits.overload
    open_field.judged("AGI", at(0.0), whole=False)
    assert set(open_field.slowed(scene.world, 2e6)) == {"AGI", "R0"}


def test_a_robot_of_unknown_place_may_be_near() -> None:
    scene = fleet(60.0)
    scene.world.robots["R0"].odometry = None
    scene.speed_limits.overload.judged("AGI", at(0.0), whole=False)
    assert factors(scene)[1] == 0.5


def test_it_ends_with_the_first_picture_that_was_judged_whole() -> None:
    scene = fleet(5.0)
    overload = scene.speed_limits.overload
    overload.judged("AGI", at(0.0), whole=False)
    overload.judged("R0", at(0.0), whole=True)
    assert factors(scene) == [0.5, 0.5]
    overload.judged("AGI", at(0.0), whole=True)
    assert overload.since == {}


def test_what_a_recording_saw_slows_no_live_robot() -> None:
    scene = fleet(3.0, 40.0, observer="AGI:recording")
    scene.speed_limits.overload.judged("AGI", at(0.0), whole=False)
    assert factors(scene)[2] == 1.0
    assert set(scene.speed_limits.overload.slowed(scene.world, 10.0)) == {"AGI"}
