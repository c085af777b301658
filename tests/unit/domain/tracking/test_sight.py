"""A zone ends by its time, or because its own camera looked there in vain."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from iveg.domain.detector import OutOfService
from iveg.domain.observations import Detection
from iveg.domain.tracking.sight import visible_from
from tests.builders import at, detection, detection_frame, origin
from tests.unit.domain.scene import HEDGE, Scene, person


@pytest.mark.parametrize(
    ("x", "y", "age", "sees"),
    [
        (4.0, 0.0, 0.0, True),
        (1.3, 0.0, 0.0, False),  # too near to be seen whole
        (6.3, 0.0, 0.0, True),
        (6.5, 0.0, 0.0, False),  # beyond three quarters of the range
        (-4.0, 0.0, 0.0, False),
        (4.0, 1.9, 0.0, True),
        (4.0, 2.3, 0.0, False),  # at the edge of the picture
        (4.0, 0.0, 0.4, True),
        (4.0, 0.0, 0.6, False),  # an old look
    ],
)
def test_a_camera_vouches_for_what_it_sees_well(
    x: float, y: float, age: float, sees: bool
) -> None:
    scene = Scene()
    scene.drive("AGI", 0.0)
    scene.look("AGI")

    robot, spots = scene.world.robot("AGI"), np.array([[x, y]])
    assert visible_from(robot, spots, scene.greenhouse, at(age)).size == sees


def watched(
    scene: Scene, seconds: float, *, yaw: float | None = 0.0, every_s: float = 0.1
) -> list[str]:
    """AGI looks ahead, may say so, and finds nobody; returns whose zones went."""
    before, end = len(scene.ended), scene.now + seconds
    while scene.now < end - 1e-9:
        if yaw is not None:
            scene.drive("AGI", 0.0, yaw=yaw, linear=0.0)
        scene.look("AGI")
        scene.now = round(scene.now + every_s, 6)
    return [one.person_id for one in scene.ended[before:]]


def remembered(scene: Scene) -> Scene:
    """AGI has seen somebody 1.1 s ago."""
    scene.drive("AGI", 0.0, linear=0.0)
    scene.look("AGI", person(4.0))
    scene.now = 1.1
    return scene


def shown(scene: Scene, *sights: Detection, times: int = 20) -> int:
    """A robot looks ahead and sees these in turn; returns how many zones went."""
    for number in range(times):
        scene.drive("AGI", 0.0, linear=0.0)
        scene.look("AGI", sights[number % len(sights)])
        scene.now = round(scene.now + 0.1, 6)
    return len(scene.ended)


def test_a_spot_that_its_own_camera_looks_at_in_vain_for_a_second_is_clear() -> None:
    scene = remembered(Scene())

    assert watched(scene, 0.95) == []
    assert watched(scene, 0.2) == ["P1"]
    assert scene.everyone[0].sightings == ()


def test_fewer_than_five_frames_end_no_zone() -> None:
    scene = remembered(Scene())

    assert watched(scene, 1.6, every_s=0.4) == []
    assert watched(scene, 0.4, every_s=0.4) == ["P1"]


@pytest.mark.parametrize(("is_counted", "ended"), [(True, 0), (False, 1)])
def test_frames_that_come_late_end_no_zone_but_those_without_a_count_do(
    is_counted: bool, ended: int
) -> None:
    scene = remembered(Scene())
    for number in range(12):
        scene.drive("AGI", 0.0, linear=0.0)
        told = origin(1000 - number, after=scene.now)
        told = told if is_counted else replace(told, boot=None, seq=None)
        scene.take(detection_frame("AGI", origin=told))
        scene.now = round(scene.now + 0.1, 6)

    assert len(scene.ended) == ended


def test_a_look_that_was_interrupted_or_not_read_whole_begins_anew() -> None:
    scene = remembered(Scene())
    watched(scene, 0.8)
    watched(scene, 0.2, yaw=3.0)
    assert watched(scene, 0.9) == []
    scene.look("AGI", unreadable=1)
    scene.now = round(scene.now + 0.1, 6)

    assert watched(scene, 1.9) == []
    assert watched(scene, 0.3) == ["P1"]


def out_of_service(scene: Scene) -> None:
    detector = scene.world.robot("AGI").detector
    detector.out_of_service = OutOfService("ana", 0.0, "boot-a")


def doubted(scene: Scene) -> None:
    scene.world.robot("AGI").doubts.contradicted("jumped", at(scene.now))


@pytest.mark.parametrize("spoil", [out_of_service, doubted])
def test_a_camera_that_is_not_relied_on_ends_no_zone(
    spoil: Callable[[Scene], None],
) -> None:
    scene = remembered(Scene())
    for _ in range(30):
        spoil(scene)
        assert watched(scene, 0.1) == []


@pytest.mark.parametrize(
    ("scene", "every_s"),
    [
        (Scene(greenhouse=HEDGE), 0.1),
        (Scene(robots=("AGI:recording", "AGII")), 0.1),
        (Scene(), 0.6),
    ],
    ids=["behind crop", "a recording", "frames with long gaps"],
)
def test_where_nothing_is_proven_no_zone_ends(scene: Scene, every_s: float) -> None:
    assert watched(remembered(scene), 4.0, every_s=every_s) == []


def test_a_robot_that_is_not_live_ends_no_zone() -> None:
    assert watched(remembered(Scene()), 3.0, yaw=None) == []


def test_who_is_seen_beside_the_spot_keeps_the_zone() -> None:
    # Too far for one chain, and near enough to be the same person.
    aside = [person(4.0, y, probability=0.3) for y in (-0.9, 0.9)]

    assert shown(remembered(Scene()), *aside, times=30) == 0


@pytest.mark.parametrize(("word", "ended"), [("scarecrow", 0), ("crate", 1)])
def test_a_word_that_nobody_knows_keeps_the_ring_and_a_known_thing_does_not(
    word: str, ended: int
) -> None:
    assert shown(remembered(Scene()), detection(word, 4.0)) == ended


def test_who_walks_by_the_laser_is_forgotten_by_time_alone() -> None:
    scene = Scene()
    scene.drive("AGI", 0.0, linear=0.0)
    scene.look("AGI")
    scene.walks_by("AGI", 4.0)
    assert watched(scene, 2.95) == []
    (one,) = scene.everyone
    assert list(one.zone_radii(scene.rule, at(2.9)))
    assert not list(one.zone_radii(scene.rule, at(3.1)))
