"""Bags of real robots: detectors of each family, transforms, and what is left out."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import DetectionFrame, Odometry
from iveg.robot.replay.replay import open_recording
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message
from tests.data.message_bags import Said, message_bag
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import WALL, link, tf
from tests.unit.robot.ros2.test_detectors import (
    CLOSE_M,
    MIDDLE,
    OPTICAL,
    TALL,
    TRUTH,
    vision_3d,
    yolact,
    yolo_2d,
    yolo_3d,
    yolox,
)

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


def drive(seconds: float = 0.2) -> list[Said]:
    """Odometry at (2, 0), ten times a second."""
    return [
        ("/odom", said.odometry(2.0, 0.0, after=n / 10), WALL + n / 10)
        for n in range(round(seconds * 10) + 1)
    ]


def recorded(path: Path, said_: Sequence[Said]) -> tuple[list[object], list[str]]:
    """Observations and the table of a bag."""
    lines: list[str] = []
    bag = message_bag(path / "run", said_)
    recording = open_recording(bag, FLEET, tell=lines.append)
    return [one.observation for one in recording()], lines


def fate(lines: Sequence[str], topic: str) -> str:
    (line,) = (one for one in lines if one.startswith(f"{topic} "))
    return re.split(r" {2,}", line, maxsplit=3)[3]


# --- transforms ---------------------------------------------------------------------


def test_without_a_map_odometry_is_the_map(tmp_path: Path) -> None:
    there = [one for one in frames() if one[0] == "/tf_static"]

    found, _ = recorded(tmp_path, [*there, *drive(), ("/seen", box_3d(), WALL + 0.2)])

    (seen,) = (one for one in found if isinstance(one, DetectionFrame))
    assert {one.pose.x for one in found if isinstance(one, Odometry)} == {2.0}
    x, y, _ = seen.detections[0].box.centre
    assert math.dist((x, y), (TRUTH[0] - 10.0, 0.0)) <= CLOSE_M


def test_odometry_without_its_transform_is_skipped_and_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    late = [("/odom", said.odometry(2.0, after=9.0), WALL + 9.0)]

    found, _ = recorded(tmp_path, [*frames(), *drive(), *late])

    assert len(found) == 3
    (told,) = caplog.messages
    assert "/odom: unusable messages are skipped" in told
    assert told.endswith("unplaced: no_transform, map → odom")


# --- detectors ----------------------------------------------------------------------


def box_3d() -> Any:
    return yolact(OPTICAL, *PERSON)


@pytest.mark.parametrize(
    "message",
    [
        vision_3d(OPTICAL, *PERSON),
        yolact(OPTICAL, *PERSON),
        yolo_3d(OPTICAL, *PERSON),
    ],
    ids=lambda one: one.ROS,
)
def test_a_detector_of_each_family_sees_the_person_where_it_is(
    message: Message, tmp_path: Path
) -> None:
    seen = ("/detector", message, WALL + 0.1)
    bag = message_bag(tmp_path / "run", [*frames(), *drive(), seen])

    found = list(open_recording(bag, FLEET)())

    (frame,) = (one for one in found if isinstance(one.observation, DetectionFrame))
    assert isinstance(frame.observation, DetectionFrame)
    (one,) = frame.observation.detections
    assert (one.class_id, one.frame_id) == ("farmer", "map")
    assert math.dist(one.box.centre[:2], TRUTH) <= CLOSE_M


def test_boxes_of_a_picture_without_depth_place_nobody(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    seen = ("/detector", yolo_2d(MIDDLE, TALL), WALL + 0.1)

    found, _ = recorded(tmp_path, [*frames(), *drive(), seen])

    assert {type(one) for one in found} == {Odometry}
    (told,) = caplog.messages
    assert told.endswith("no_depth: boxes in a picture")


# --- what is ignored ----------------------------------------------------------------


def test_the_table_tells_of_every_topic_what_becomes_of_it(tmp_path: Path) -> None:
    seen = [
        ("/scan", said.scan(), WALL),
        ("/yolox/bounding_box", yolox(MIDDLE, TALL), WALL),
        ("/plan", ros.Path(), WALL),
    ]

    _, lines = recorded(tmp_path, [*frames(), *drive(), *seen])

    assert lines[0].endswith("run:")
    read = ["/odom", "/scan", "/tf", "/tf_static"]
    roles = ["odometry", "scan", "tf", "tf_static"]
    assert [fate(lines, topic) for topic in read] == roles
    for topic in ("/yolox/bounding_box", "/plan"):
        assert fate(lines, topic) == "ignored: not needed"
    (odom,) = (one for one in lines if one.startswith("/odom "))
    assert odom.split() == ["/odom", "nav_msgs/msg/Odometry", "3", "odometry"]


def test_a_type_of_the_same_name_with_other_fields_is_named_by_its_hash(
    tmp_path: Path,
) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    kind = d.BoundingBoxes3d.ROS
    store.register(get_types_from_msg("std_msgs/Header header\n", kind))
    lines: list[str] = []
    seen: list[Said] = [("/seen", d.BoundingBoxes3d(OPTICAL), WALL)]
    bag = message_bag(tmp_path / "run", [*drive(), *seen], store=store)

    open_recording(bag, FLEET, tell=lines.append)

    digest = store.hash_rihs01(kind)
    assert fate(lines, "/seen") == f"ignored: another definition, {digest}"
