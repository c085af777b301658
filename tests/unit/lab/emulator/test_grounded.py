"""Boxes by mask and depth: near the truth, hidden by what hides, lost where dark."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iveg.adapters.greenhouses import load_greenhouse
from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.lab.emulator.camera import EmulatedDetector, FoundTarget
from iveg.lab.emulator.detector_model import DETECTORS
from iveg.lab.emulator.greenhouse import Body, Disc, Scenery
from iveg.lab.emulator.grounded import GroundedCamera
from iveg.lab.emulator.layout import lay_out
from iveg.lab.emulator.scenarios import scenario_named
from iveg.lab.emulator.targets import Target, person_target, robot_target
from iveg.lab.emulator.world import SimulatedWorld
from tests.builders import AGI

GREENHOUSE = Greenhouse(
    "house",
    Rectangle(-20.0, -20.0, 20.0, 20.0),
    rows=(Rectangle(-19.0, 1.5, 19.0, 2.5),),
)
CROP = Scenery.of(GREENHOUSE)
HERE = Pose2D(0.0, 0.0, 0.0)


def camera(seed: int = 1) -> GroundedCamera:
    return GroundedCamera(AGI, np.random.default_rng(seed))


def person(x: float, y: float = 0.0) -> Target:
    return person_target(0, Disc(x, y, 0.25))


@pytest.mark.parametrize("ahead", [1.5, 3.0, 4.5, 6.0, 7.5])
@pytest.mark.parametrize("yaw", [0.0, -2.5])
def test_a_person_is_placed_near_the_truth_at_any_distance(
    ahead: float, yaw: float
) -> None:
    pose = Pose2D(1.0, -1.0, yaw)
    x, y = pose.transform(ahead, 0.1)

    ((found,), lost) = camera().place(pose, [FoundTarget(person(x, y), 0.9)], [], CROP)

    assert found.frame_id == "base_link"
    assert found.box.centre[:2] == pytest.approx((ahead, 0.1), abs=0.35)
    assert (found.class_id, found.probability, lost) == ("farmer", 0.9, ())


def test_a_robot_shows_the_face_that_is_seen() -> None:
    peer = robot_target(Body("AGII", Pose2D(4.0, 0.0, 0.0), 1.4, 0.8))

    ((found,), _) = camera().place(HERE, [FoundTarget(peer, 0.9)], [peer], CROP)

    assert found.class_id == "AGII"
    assert found.box.xmin == pytest.approx(3.3, abs=0.15)


def test_crop_hides_a_person_from_the_picture_too() -> None:
    assert camera().place(HERE, [FoundTarget(person(4.0, 3.2), 0.9)], [], CROP) == (
        (),
        (),
    )


def test_a_person_behind_a_robot_is_not_in_the_picture() -> None:
    near = robot_target(Body("AGII", Pose2D(2.0, 0.0, 0.0), 1.4, 3.0))
    tall = replace(near, height=1.2)
    behind = person(3.2)

    (found, lost) = camera().place(
        HERE, [FoundTarget(behind, 0.9)], [tall, behind], CROP
    )

    heads = [one.box.zmin for one in found]
    assert lost == ()
    assert all(bottom > 0.5 for bottom in heads)


def test_whom_depth_cannot_reach_counts_as_there_without_a_place() -> None:
    far = person(9.5)

    assert camera().place(HERE, [FoundTarget(far, 0.9)], [far], CROP) == (
        (),
        ("farmer",),
    )


def test_the_detector_tells_who_has_no_place_until_the_next_look() -> None:
    detector = EmulatedDetector(
        AGI,
        DETECTORS["perfect"],
        np.random.default_rng(1),
        lambda *_: ((), ("farmer",)),
    )

    seen = detector.detect(0.0, HERE, [person(3.0)], CROP)
    lost = detector.lost
    detector.detect(10.0, HERE, [], CROP)

    assert (seen, lost, detector.lost) == ((), ("farmer",), ())


def test_both_cameras_find_the_same_people_in_nearly_the_same_places() -> None:
    greenhouse = load_greenhouse("mvsim-20x20")
    layout = lay_out(scenario_named("demo"), ("AGI", "AGII"), greenhouse)
    drawn, grounded = (
        SimulatedWorld(greenhouse, layout, DETECTORS["perfect"], 1, kind)
        for kind in ("boxes", "grounding")
    )
    pairs = 0
    for tick in range(60):
        for world in (drawn, grounded):
            world.walk(0.1)
        for robot_id in ("AGI", "AGII"):
            truth = drawn.rigs[robot_id].detect(tick / 10, drawn).detections
            found = grounded.rigs[robot_id].detect(tick / 10, grounded)
            assert len(found.detections) + len(found.unread) == len(truth)
            for one, other in zip(found.detections, truth, strict=False):
                away = math.dist(one.box.centre[:2], other.box.centre[:2])
                assert away < (0.4 if one.class_id == "farmer" else 1.0)
                pairs += 1
    assert pairs > 20
