"""People in boxes without a frame, and in frames that nobody described."""

import math
from dataclasses import replace

import pytest

from iveg.domain.fleet import Frame
from iveg.domain.geometry import Box3D, Pose2D
from iveg.domain.observations import Detection
from tests.builders import at
from tests.unit.domain.scene import Scene, machine

HERE = Pose2D(3.2, -7.1, 2.3)
PERSON = 1.1, -3.4
"""A place before the robot, in ``map`` (m)."""


def seen_from(pose: Pose2D, x: float, y: float) -> tuple[float, float]:
    """A place of ``map`` as it is seen from a pose (m)."""
    dx, dy = x - pose.x, y - pose.y
    cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
    return cos * dx + sin * dy, cos * dy - sin * dx


def box_at(x: float, y: float, z: float = 0.9) -> Box3D:
    return Box3D(x - 0.25, x + 0.25, y - 0.25, y + 0.25, z - 0.9, z + 0.9)


def somebody(robot_id: str, frame: Frame, named: str | None = None) -> Detection:
    """The person's box as a detector has it whose numbers are in ``frame``."""
    camera = HERE.compose(Scene().world.robot(robot_id).profile.camera)
    ahead, left = seen_from(camera, *PERSON)
    box = {
        "map": box_at(*PERSON),
        "base_link": box_at(*seen_from(HERE, *PERSON)),
        "camera_link": box_at(ahead, left, 0.3),
        "camera_optical_frame": Box3D(
            -left - 0.25, -left + 0.25, -1.2, 0.6, ahead - 0.25, ahead + 0.25
        ),
    }
    return Detection("farmer", 0.94, box[frame], named)


def scene_of(robot_id: str, unlabelled_frame: Frame | None = None) -> Scene:
    scene = Scene()
    robot = scene.world.robot(robot_id)
    profile = replace(robot.profile, unlabelled_frame=unlabelled_frame)
    robot.description = replace(robot.description, profile=profile)
    scene.drive(robot_id, HERE.x, HERE.y, HERE.yaw)
    return scene


robots = pytest.mark.parametrize("robot_id", ["AGI", "AGII"])
frames = pytest.mark.parametrize(
    "frame", ["map", "base_link", "camera_link", "camera_optical_frame"]
)


@robots
@frames
def test_a_box_without_a_frame_lands_on_the_person_where_the_fleet_names_the_frame(
    robot_id: str, frame: Frame
) -> None:
    scene = scene_of(robot_id, frame)

    (placed,) = scene.look(robot_id, somebody(robot_id, frame))

    assert math.dist(placed.position[:2], PERSON) < 0.05
    assert placed.position[2] == pytest.approx(0.9)


@robots
@pytest.mark.parametrize("frame", ["base_link", "camera_link"])
def test_until_the_fleet_names_it_there_is_a_zone_at_both_places(
    robot_id: str, frame: Frame
) -> None:
    scene = scene_of(robot_id)
    for tenth in range(20):
        scene.now = tenth / 10
        scene.look(robot_id, somebody(robot_id, frame))

    zones = [
        (look.x, look.y, radius)
        for known in scene.everyone
        for look, radius in known.zone_radii(scene.rule, at(1.9))
    ]
    apart = math.dist(zones[0][:2], zones[1][:2])
    assert [radius for *_, radius in zones] == [2.0, 2.0]
    assert apart == pytest.approx(scene.world.robot(robot_id).profile.camera.x)
    assert min(math.dist(place[:2], PERSON) for place in zones) < 0.05


def test_a_peer_in_a_box_without_a_frame_is_that_peer_at_both_places() -> None:
    scene = scene_of("AGI")
    scene.drive("AGII", 3.2, -3.1)
    ahead, left = seen_from(HERE, 3.2, -3.1)
    seen = replace(machine(0.0), box=box_at(ahead, left), frame_id=None)

    placed = scene.look("AGI", seen)

    assert [one.peer for one in placed] == ["AGII", "AGII"]


@pytest.mark.parametrize(
    ("scene", "named", "unknown"),
    [(scene_of("AGI"), "odom", ["odom"]), (Scene(), "base_link", [])],
    ids=["a frame that nobody described", "by a robot without a pose"],
)
def test_who_cannot_be_placed_is_counted(
    scene: Scene, named: str, unknown: list[str]
) -> None:
    assert scene.look("AGI", somebody("AGI", "base_link", named)) == []
    assert scene.people.unplaced == 1
    assert sorted(scene.people.unknown_frames) == unknown
