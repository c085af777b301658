"""Which frame a box is in, by its name, and what becomes of it in ``base_link``."""

import math
from dataclasses import replace

import pytest

from iveg.domain.fleet import CAUTIOUS, Frame, RobotDescription
from iveg.domain.frames import (
    FramedBox,
    frame_named,
    is_pose_frame,
    may_be_laser_frame,
    resolve_box,
)
from iveg.domain.geometry import Box3D, Pose2D
from iveg.domain.observations import Detection
from tests.builders import AGI

BOX = Box3D(1.0, 3.0, 0.0, 0.5, 0.0, 1.8)
ROBOT = RobotDescription("AGI", profile=AGI)
UNDESCRIBED = RobotDescription("R1")


def boxes(
    frame_id: str | None, box: Box3D = BOX, robot: RobotDescription = ROBOT
) -> list[FramedBox | None]:
    return list(resolve_box(Detection("farmer", 0.9, box, frame_id), robot))


@pytest.mark.parametrize(
    ("name", "frame"),
    [
        ("map", "map"), ("/map", "map"), ("AGI/base_link", "base_link"),
        ("/greenhouse/agi/base_link", "base_link"), ("agi_base_link", "base_link"),
        ("camera_link", "camera_link"),
        ("camera_color_optical_frame", "camera_optical_frame"),
        ("agi/camera_depth_optical", "camera_optical_frame"),
    ],
)  # fmt: skip
def test_names_of_tf_are_known_with_slashes_and_the_robots_own_prefix(
    name: str, frame: Frame
) -> None:
    assert frame_named(name, "AGI") == frame
    assert frame_named("carrier_2/base_link", "CARRIER-2") == "base_link"


@pytest.mark.parametrize(
    "name",
    [
        "odom", "world", "/", "Map", "camera", "laser", "AGII/base_link",
        "AGII/camera_optical_frame", "agii_base_link", "base_link/AGI", "unplaced",
        "rear_camera_link", "agi_rear_camera_optical_frame",
    ],
)  # fmt: skip
def test_other_names_and_the_prefixes_of_others_are_unknown(name: str) -> None:
    assert frame_named(name, "AGI") is None
    assert boxes(name) == [None]


def test_a_camera_of_another_name_is_the_one_that_the_fleet_file_names() -> None:
    named = replace(AGI, camera_frame="zed_left_optical_frame")
    robot = RobotDescription("AGI", profile=named)

    assert boxes("agi/zed_left_optical_frame", robot=robot) == boxes("camera_optical")
    assert boxes("zed_right_optical_frame", robot=robot) == [None]


def test_odometry_is_in_map_or_in_the_frame_that_the_fleet_file_names() -> None:
    in_odom = replace(ROBOT, pose_frame="odom")

    assert all(is_pose_frame(one, ROBOT) for one in ("map", "/map", "AGI/map"))
    assert not any(is_pose_frame(one, ROBOT) for one in ("odom", "AGII/map", "Map"))
    assert [is_pose_frame(one, in_odom) for one in ("agi/odom", "map")] == [True, False]
    assert boxes("odom", robot=in_odom) == boxes("map")


@pytest.mark.parametrize(
    ("name", "may_be"),
    [
        ("laser", True), ("/AGI/base_scan", True), ("agi_lidar_link", True),
        ("base_link", True), ("map", False), ("AGI/odom", False), ("agi_map", False),
        ("AGII/laser", False), ("camera_depth_optical_frame", False),
    ],
)  # fmt: skip
def test_a_scan_is_in_a_level_frame_of_its_own_robot(name: str, may_be: bool) -> None:
    assert may_be_laser_frame(name, "AGI") is may_be


@pytest.mark.parametrize("name", ["map", "base_link"])
def test_a_box_in_map_or_base_link_stays_as_it_is(name: str) -> None:
    (found,) = boxes(name, robot=UNDESCRIBED)

    assert found is not None
    assert (found.box, found.frame_id) == (BOX, name)


def test_the_box_of_a_turned_camera_keeps_its_turned_centre() -> None:
    turned = replace(AGI, camera=Pose2D(0.2, 0.1, math.pi / 4))

    (found,) = boxes("camera_link", robot=RobotDescription("AGI", profile=turned))

    assert found is not None
    x, y, _ = found.box.centre
    assert (x, y) == pytest.approx(turned.camera.transform(2.0, 0.25))


def test_a_box_without_a_frame_may_be_in_either() -> None:
    assert boxes(None) == boxes("base_link") + boxes("camera_link")


@pytest.mark.parametrize("frame_id", ["camera_link", "camera_optical_frame"])
def test_nobody_knows_the_place_of_a_camera_that_nobody_described(
    frame_id: str,
) -> None:
    assert CAUTIOUS.has_known_camera is False
    assert boxes(frame_id, robot=UNDESCRIBED) == [None]
    assert boxes(None, robot=UNDESCRIBED) == [*boxes("base_link"), None]
