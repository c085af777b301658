"""A ring ends because somebody has looked there in vain, never for one empty frame."""

from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.detection_rule import DetectionRule
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import PlacedObstacle
from iveg.domain.tracking.sight import beside, visible_from
from tests.builders import at, detection
from tests.unit.domain.scene import HEDGE, Scene, person


def can_see(
    scene: Scene, x: float, y: float, *, robot_id: str = "AGI", now: float = 0.0
) -> bool:
    """Whether a robot's camera has a spot in view."""
    robot, spots = scene.world.robot(robot_id), np.array([[x, y]])
    return visible_from(robot, spots, scene.greenhouse, at(now)).size == 1


def watched(
    scene: Scene, seconds: float, *, x: float = 0.0, yaw: float = 0.0
) -> list[str]:
    """AGI looks ahead ten times a second; returns whose rings went, in order."""
    gone = []
    end = scene.now + seconds
    while scene.now < end - 1e-9:
        scene.drive("AGI", x, yaw=yaw, linear=0.0)
        scene.look("AGI")
        gone += [one.person_id for one in scene.sweep()]
        scene.now = round(scene.now + 0.1, 6)
    return gone


def remembered(scene: Scene, x: float = 4.0) -> Scene:
    """AGII has seen somebody 1.1 s ago."""
    scene.look("AGII", person(x))
    scene.now = 1.1
    return scene


def test_a_spot_looked_at_in_vain_for_a_second_is_clear() -> None:
    scene = remembered(Scene())

    assert watched(scene, 0.95) == []
    assert watched(scene, 0.2) == ["P1"]
    assert scene.everyone[0].sightings == ()


def test_a_look_that_was_interrupted_begins_anew() -> None:
    scene = remembered(Scene())
    watched(scene, 0.8)
    watched(scene, 0.2, yaw=3.0)

    assert watched(scene, 0.9) == []


def test_who_contradicts_itself_finds_no_spot_empty() -> None:
    scene = remembered(Scene())
    for _ in range(30):
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI")
        scene.world.robot("AGI").doubts.contradicted("jumped", at(scene.now))
        assert scene.sweep() == []
        scene.now = round(scene.now + 0.1, 6)


def test_a_frame_that_was_not_read_whole_finds_no_spot_empty() -> None:
    scene = remembered(Scene())
    for _ in range(30):
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI", unreadable=1)
        assert scene.sweep() == []
        scene.now = round(scene.now + 0.1, 6)


def test_somebody_who_is_still_seen_keeps_the_ring() -> None:
    scene = Scene()
    scene.look("AGII", person(4.0))
    for _ in range(30):
        scene.now = round(scene.now + 0.1, 6)
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI", person(4.0))
        assert not [one for one in scene.sweep() if not one.sightings]

    assert scene.everyone[0].sightings


def test_somebody_who_is_seen_faintly_has_a_ring_all_the_time() -> None:
    scene = remembered(Scene())
    for _ in range(30):
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI", person(4.0, probability=0.6))
        scene.sweep()
        scene.now = round(scene.now + 0.1, 6)

        assert any(one.x == 4.0 for p in scene.everyone for one in p.sightings)


def test_where_only_single_boxes_count_a_faint_one_keeps_the_ring() -> None:
    scene = remembered(Scene(rule=DetectionRule(possible_people=False)))
    for _ in range(30):
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI", person(4.0, probability=0.6))
        assert scene.sweep() == []
        scene.now = round(scene.now + 0.1, 6)


def test_something_else_at_that_spot_does_not_keep_the_ring() -> None:
    scene = remembered(Scene())
    gone = []
    for _ in range(15):
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI", detection("crate", 4.0))
        gone += scene.sweep()
        scene.now = round(scene.now + 0.1, 6)

    assert len(gone) == 1


def test_a_spot_behind_crop_cannot_be_cleared() -> None:
    scene = remembered(Scene(greenhouse=HEDGE))

    assert watched(scene, 3.0) == []


def test_a_recording_clears_nothing() -> None:
    scene = remembered(Scene(robots=("AGI:recording", "AGII")))

    assert watched(scene, 3.0) == []


def test_whom_a_recording_saw_no_look_of_today_clears() -> None:
    scene = remembered(Scene(robots=("AGI", "AGII:recording")))

    assert watched(scene, 3.0) == []


def test_a_robot_that_nobody_described_clears_nothing() -> None:
    scene = Scene(robots=("AG3", "AGII"))
    scene.look("AGII", person(4.0))
    scene.now = 1.1
    scene.drive("AG3", 0.0)
    scene.look("AG3")

    assert not can_see(scene, 4.0, 0.0, robot_id="AG3", now=1.1)


def test_only_the_circles_that_were_looked_at_go() -> None:
    scene = Scene(robots=("AGI", "AGII", "AG3"))
    scene.look("AGII", person(4.0))
    scene.now = 0.5
    scene.look("AG3", person(4.5))
    scene.now = 1.1

    watched(scene, 1.1)

    assert [one.observer for one in scene.everyone[0].sightings] == ["AG3"]


@pytest.mark.parametrize(
    ("x", "y", "sees"),
    [
        (4.0, 0.0, True),
        (1.3, 0.0, False),  # too near to be seen whole
        (6.3, 0.0, True),
        (6.5, 0.0, False),  # beyond three quarters of the range
        (-4.0, 0.0, False),
        (4.0, 1.9, True),
        (4.0, 2.3, False),  # at the edge of the picture
    ],
)
def test_a_camera_vouches_for_what_it_sees_well(x: float, y: float, sees: bool) -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.look("AGI")

    assert can_see(scene, x, y) is sees


@pytest.mark.parametrize(("age", "sees"), [(0.4, True), (0.6, False), (2.0, False)])
def test_an_old_look_vouches_for_nothing(age: float, sees: bool) -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.look("AGI")

    assert can_see(scene, 4.0, 0.0, now=age) is sees


def test_a_robot_that_never_looked_vouches_for_nothing() -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)

    assert not can_see(scene, 4.0, 0.0)


CRATES = Rectangle(4.0, 4.0, 5.2, 4.6)
YARD = replace(HEDGE, obstacles=(PlacedObstacle("crates", CRATES),))


@pytest.mark.parametrize(
    ("box", "seen_from", "places"),
    [
        ((2.95, 1.0), (0.0, 0.0), [(2.6, 1.0)]),
        ((2.95, 1.0), (6.0, 0.0), [(3.4, 1.0)]),
        ((2.8, 1.0), (0.0, 0.0), [(2.8, 1.0)]),
        ((4.6, 4.1), (4.5, 0.0), [(4.6, 3.7)]),
        ((4.6, 4.3), (4.5, 0.0), [(4.6, 3.7), (4.6, 4.9)]),
        ((4.3, 4.1), (4.5, 9.0), [(3.7, 4.1), (4.3, 3.7)]),
        ((100.3, 1.0), (90.0, 0.0), [(99.7, 1.0)]),
        ((100.5, 1.0), (90.0, 0.0), [(100.5, 1.0)]),
    ],
)
def test_who_is_seen_in_what_the_plan_draws_stands_beside_it(
    box: tuple[float, float],
    seen_from: tuple[float, float],
    places: list[tuple[float, float]],
) -> None:
    found = beside(YARD, *box, Pose2D(*seen_from, 0.0))
    assert np.array(found) == pytest.approx(np.array(places))


@pytest.mark.parametrize(("y", "gone"), [(0.0, ["P1"]), (2.9, [])])
def test_who_was_seen_in_crates_is_gone_when_each_side_that_is_near_is_empty(
    y: float, gone: list[str]
) -> None:
    """Near the crates their front is too near to be in the picture."""
    scene = Scene(greenhouse=replace(YARD, rows=()))
    scene.drive("AGI", 4.3, y, 1.57, linear=0.0)
    scene.look("AGI", person(4.3, 4.1))
    scene.now = 1.1
    ended = list[str]()
    for _ in range(13):
        scene.drive("AGI", 4.3, y, 1.57, linear=0.0)
        scene.look("AGI")
        ended += [one.person_id for one in scene.sweep()]
        scene.now = round(scene.now + 0.1, 6)
    assert ended == gone


def test_a_mistake_in_the_crop_goes_as_the_place_beside_it_is_seen_to_be_empty() -> (
    None
):
    scene = Scene(greenhouse=HEDGE)
    scene.drive("AGI", 0.0, linear=0.0)
    scene.look("AGI", person(3.0, 0.5))
    scene.now = 1.1
    assert watched(scene, 1.2) == ["P1"]
