"""Whoever walks beside a robot, by its own laser, is a zone for the whole fleet."""

from dataclasses import replace

from iveg.domain.feedback import FULL_SPEED, HALF_SPEED
from iveg.domain.observations import ReportedObstacle
from iveg.domain.tracking.tracker import MAX_LASER_TRACKS
from tests.builders import safety_report
from tests.unit.domain.scene import Scene, person
from tests.unit.vital.desk import Desk


def beside(
    desk: Desk, *seen: tuple[float, float], moved: bool = True, robot_id: str = "AGI"
) -> dict[str, float]:
    """A tenth of a second later both robots are heard; the factor of each."""
    desk.clock.now = round(desk.clock.now + 0.1, 6)
    for name, x in (("AGI", 0.0), ("AGII", 8.0)):
        desk.drive(name, x, linear=0.0)
        desk.look(name)
    for x, y in seen:
        told = safety_report(robot_id, speed_factor=0.5, reason="obstacle")
        obstacle = ReportedObstacle(x, y, 0.5, moved)
        desk.hear(replace(told, obstacle=obstacle, origin=desk.next_origin()))
    desk.loop.step([], desk.clock())
    limits = desk.evaluator.speed_limits
    return {name: one.speed_factor for name, one in limits.items()}


def test_who_walks_by_one_robots_laser_slows_the_other_for_three_seconds() -> None:
    desk = Desk(("AGI", "AGII"))
    assert beside(desk)["AGII"] == FULL_SPEED

    assert beside(desk, (6.5, 0.0))["AGII"] == HALF_SPEED
    (alert,) = desk.fleet.told[-1].alerts
    assert (alert.class_, alert.class_id, alert.observer) == ("person", "laser", "AGI")
    assert alert.radius_m == 2.0
    assert "log.walker" in desk.sentences()
    factors = [beside(desk)["AGII"] for _ in range(45)]
    assert set(factors[:29]) == {HALF_SPEED}
    assert factors[-1] == FULL_SPEED, "3 s, and 1 s until the limit is lifted"


def test_what_has_not_moved_or_orion_kept_is_nobody() -> None:
    desk = Desk(("AGI", "AGII"))
    beside(desk)
    kept = replace(safety_report(), obstacle=ReportedObstacle(6.5, 0.0, 0.5, True))
    desk.hear(replace(kept, origin=desk.next_origin()), is_query_answer=True)

    assert beside(desk, (6.5, 0.0), moved=False)["AGII"] == FULL_SPEED
    assert desk.evaluator.people.known == {}


def test_whom_a_camera_sees_there_has_one_name_and_both_zones() -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.walks_by("AGI", 4.0)
    scene.now = 0.1
    scene.look("AGI", person(4.1))
    scene.now = 0.2
    scene.walks_by("AGI", 4.0)

    (one,) = scene.everyone
    assert one.newest.class_id == "farmer"
    assert sorted(look.laser for look in one.sightings) == [False, True]


def test_one_robots_walkers_take_no_place_of_anothers() -> None:
    scene = Scene()
    for number in range(MAX_LASER_TRACKS + 4):
        kept = scene.walks_by("AGI", -50.0 + 6.0 * number)
        assert (kept is not None) == (number < MAX_LASER_TRACKS)

    assert scene.walks_by("AGII", 50.0) is not None


def test_walkers_of_long_ago_make_room_for_new_ones() -> None:
    scene = Scene()
    for number in range(4 * MAX_LASER_TRACKS):
        scene.now = number * 1.0
        assert scene.walks_by("AGI", -50.0 + 4.0 * number) is not None
    assert len(scene.everyone) <= MAX_LASER_TRACKS
