"""Bags of real robots: detectors of each family, transforms, and what is left out."""

import math
from pathlib import Path

import pytest

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import DetectionFrame, Odometry
from iveg.robot.replay.replay import open_recording
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message
from tests.data.message_bags import Said, message_bag
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import WALL, link, tf
from tests.unit.robot.ros2.test_detectors import (
    CLOSE_M,
    TRUTH,
    vision_3d,
    yolact,
    yolo_3d,
)
from tests.unit.robot.ros2.test_pictures import OPTICAL

FLEET = Pose2D(0.5, 0.0, 0.0)
"""Where the fleet file says that the laser sits."""
PERSON = ros.Point(0.0, 0.1, 3.0), ros.Vector3(0.6, 1.8, 0.4)
"""In the camera's optical frame."""


def frames() -> list[Said]:
    """A robot at (10, 0) in map that looks east; its camera 1 m above the floor."""
    turned = ros.Quaternion(-0.5, 0.5, -0.5, 0.5)
    camera = ros.Transform(ros.Vector3(-2.0, 0.0, 1.0), turned)
    base = ros.Header(frame_id="base_link")
    at_camera = ros.TransformStamped(base, OPTICAL.frame_id, camera)
    backwards = link("base_link", "laser", -0.3, yaw=math.pi)
    return [
        ("/tf_static", ros.TFMessage((at_camera, backwards)), WALL),
        ("/tf", tf(link("map", "odom", 10.0)), WALL),
        ("/tf", tf(link("odom", "base_link", 2.0)), WALL),
    ]


def drive() -> list[Said]:
    """Odometry at (2, 0), ten times a second."""
    return [
        ("/odom", said.odometry(2.0, 0.0, after=n / 10), WALL + n / 10)
        for n in range(3)
    ]


def played(path: Path, *seen: Said) -> list[object]:
    """Observations of a bag."""
    recording = open_recording(message_bag(path / "run", seen), FLEET)
    return [one.observation for one in recording()]


def test_without_a_map_odometry_is_the_map(tmp_path: Path) -> None:
    there = [frames()[0], frames()[2]]

    found = played(
        tmp_path, *there, *drive(), ("/seen", yolact(OPTICAL, *PERSON), WALL + 0.2)
    )

    (seen,) = (one for one in found if isinstance(one, DetectionFrame))
    assert {one.pose.x for one in found if isinstance(one, Odometry)} == {2.0}
    x, y, _ = seen.detections[0].box.centre
    assert math.dist((x, y), (TRUTH[0] - 10.0, 0.0)) <= CLOSE_M


@pytest.mark.parametrize(
    "message",
    [made(OPTICAL, *PERSON) for made in (vision_3d, yolact, yolo_3d)],
    ids=lambda one: one.ROS,
)
def test_a_detector_of_each_family_sees_the_person_where_it_is(
    message: Message, tmp_path: Path
) -> None:
    seen = ("/detector", message, WALL + 0.1)

    found = played(tmp_path, *frames(), *drive(), seen)

    (frame,) = (one for one in found if isinstance(one, DetectionFrame))
    (one,) = frame.detections
    assert (one.class_id, one.frame_id) == ("farmer", "map")
    assert math.dist(one.box.centre[:2], TRUTH) <= CLOSE_M
