"""A camera that reports nobody where another one surely sees somebody is named."""

from dataclasses import replace
from typing import Any

import pytest

from iveg.domain import alerts
from iveg.domain.detector import OutOfService
from iveg.domain.geometry import Rectangle
from iveg.domain.greenhouse import Greenhouse, PlacedObstacle
from iveg.domain.observations import Detection
from tests.builders import at
from tests.unit.domain.scene import FIELD, HEDGE, Scene, person

SPOT = 4.0


def watch(
    scene: Scene,
    seconds: float,
    *covered: Detection,
    seen: tuple[Detection, ...] = (person(SPOT),),
    yaw: float = 0.0,
    peer: tuple[float, float] = (50.0, 50.0),
) -> Scene:
    """AGII looks at somebody from the side; AGI ahead, and shows what it is given."""
    end = scene.now + seconds
    while scene.now < end - 1e-9:
        scene.drive("AGII", SPOT, -3.0, 1.57, linear=0.0)
        scene.look("AGII", *seen)
        scene.drive("AG3", *peer, linear=0.0)
        scene.look("AG3")
        scene.drive("AGI", 0.0, yaw=yaw, linear=0.0)
        scene.look("AGI", *covered)
        scene.now = round(scene.now + 0.1, 6)
    return scene


def fleet(greenhouse: Greenhouse = FIELD) -> Scene:
    return Scene(("AGI", "AGII", "AG3"), greenhouse)


def blind_by(scene: Scene) -> str | None:
    return scene.world.robot("AGI").detector.blind_by


def test_a_covered_lens_is_named_after_five_seconds_and_no_frame_of_it_is_whole() -> (
    None
):
    scene = fleet()
    assert blind_by(watch(scene, 5.0)) is None
    assert scene.judge()["AG3"].speed_factor == 1.0

    assert blind_by(watch(scene, 0.2)) == "AGII"
    robot, now = scene.world.robot("AGI"), at(scene.now)
    assert robot.detector.is_missing(now)
    assert scene.judge()["AGI"].speed_factor == 0.5
    (told,) = (
        one
        for one in alerts.of_detector(robot, now, started=at(0.0))
        if one.key == "alert.camera_blind"
    )
    assert (told.priority, dict(told.slots)) == ("P2", {"robot": "AGI", "by": "AGII"})


def test_it_stands_after_they_are_gone_until_the_camera_shows_somebody_again() -> None:
    scene = watch(fleet(), 5.2)

    assert blind_by(watch(scene, 3.0, seen=())) == "AGII"
    assert blind_by(watch(scene, 1.2, person(SPOT, probability=0.3))) is None
    assert not scene.world.robot("AGI").detector.is_missing(at(scene.now))


def test_a_blind_camera_that_shows_somebody_elsewhere_is_blind_and_ends_no_zone() -> (
    None
):
    scene = watch(fleet(), 5.2, person(2.0, 1.0))
    assert blind_by(scene) == "AGII"
    scene.look("AGI", person(3.0, 1.2))
    watch(scene, 4.0)

    assert blind_by(scene) == "AGII"
    assert scene.ended == []


CRATES = PlacedObstacle("crates", Rectangle(2.0, -0.3, 2.5, 0.3))


@pytest.mark.parametrize(
    ("greenhouse", "watched"),
    [
        (HEDGE, {}),
        (replace(FIELD, obstacles=(CRATES,)), {}),
        (FIELD, {"peer": (2.0, 0.0)}),
        (FIELD, {"yaw": 2.0}),
        (FIELD, {"seen": ()}),
        (FIELD, {"seen": (person(SPOT, probability=0.7),)}),
    ],
    ids=["crop", "crates", "a peer", "out of view", "nobody", "not surely seen"],
)
def test_who_stands_behind_something_or_is_not_surely_seen_blinds_nobody(
    greenhouse: Greenhouse, watched: dict[str, Any]
) -> None:
    assert blind_by(watch(fleet(greenhouse), 8.0, **watched)) is None


def test_a_robot_that_contradicts_itself_names_nobody_blind() -> None:
    scene = fleet()
    for _ in range(80):
        scene.world.robot("AGII").doubts.contradicted("jumped", at(scene.now))
        watch(scene, 0.1)
    assert blind_by(scene) is None


def test_a_camera_that_an_operator_took_out_of_service_is_blind_no_more() -> None:
    scene = watch(fleet(), 5.2)
    detector = scene.world.robot("AGI").detector
    detector.out_of_service = OutOfService("ana", 0.0, "boot-a")

    assert blind_by(watch(scene, 6.0)) is None
    assert not detector.is_missing(at(scene.now))


@pytest.mark.parametrize("shown", [(), (person(SPOT, probability=0.3),)])
def test_late_frames_among_fresh_ones_prove_nothing_of_a_lens_but_whom_they_show(
    shown: tuple[Detection, ...],
) -> None:
    scene = fleet()
    for _ in range(10):
        watch(scene, 0.4)
        scene.look("AGI", *shown, late_s=0.7)
        scene.now = round(scene.now + 0.2, 6)

    assert blind_by(scene) == (None if shown else "AGII")
