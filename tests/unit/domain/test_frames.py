"""Which frame a box is in, by its name, and what becomes of it in ``base_link``."""

import math
from dataclasses import replace

import pytest

from iveg.domain.fleet import CAUTIOUS, Frame, RobotDescription
from iveg.domain.frames import FramedBox, frame_named, resolve_box
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
        ("map", "map"),
        ("/map", "map"),
        ("AGI/map", "map"),
        ("base_link", "base_link"),
        ("AGI/base_link", "base_link"),
        ("/agi/base_link", "base_link"),
        ("/greenhouse/agi/base_link", "base_link"),
        ("agi_base_link", "base_link"),
        ("camera_link", "camera_link"),
        ("/AGI/camera_link", "camera_link"),
        ("camera_optical_frame", "camera_optical_frame"),
        ("camera_color_optical_frame", "camera_optical_frame"),
        ("agi/camera_depth_optical", "camera_optical_frame"),
    ],
)
def test_names_of_tf_are_known_with_slashes_and_the_robots_own_prefix(
    name: str, frame: Frame
) -> None:
    assert frame_named(name, "AGI") == frame


@pytest.mark.parametrize(
    "name",
    [
        "odom",
        "world",
        "/",
        "Map",
        "camera",
        "laser",
        "AGII/base_link",
        "AGII/camera_optical_frame",
        "agii_base_link",
        "base_link/AGI",
        "unplaced",
    ],
)
def test_other_names_and_the_prefixes_of_others_are_unknown(name: str) -> None:
    assert frame_named(name, "AGI") is None
    assert boxes(name) == [None]


def test_a_hyphen_of_a_robots_id_is_an_underscore_in_tf() -> None:
    assert frame_named("carrier_2/base_link", "CARRIER-2") == "base_link"
    assert frame_named("CARRIER-2/base_link", "CARRIER-2") == "base_link"


def test_a_robot_may_be_called_as_a_frame_begins() -> None:
    assert frame_named("base_link", "base") == "base_link"
    assert frame_named("camera_optical_frame", "camera") == "camera_optical_frame"


@pytest.mark.parametrize("name", ["map", "base_link"])
def test_a_box_in_map_or_base_link_stays_as_it_is(name: str) -> None:
    (found,) = boxes(name, robot=UNDESCRIBED)

    assert found is not None
    assert (found.box, found.frame_id) == (BOX, name)


def test_a_box_in_camera_link_is_moved_by_the_mount() -> None:
    (found,) = boxes("camera_link")

    assert found == FramedBox(Box3D(1.4, 3.4, 0.0, 0.5, 0.6, 2.4), "base_link")


def test_in_optical_axes_x_is_right_y_is_down_and_z_is_forward() -> None:
    (found,) = boxes("camera_optical_frame", Box3D(0.1, 0.3, -1.2, 0.4, 2.0, 2.5))

    assert found is not None
    sides = found.box
    assert (sides.xmin, sides.xmax) == pytest.approx((2.4, 2.9))
    assert (sides.ymin, sides.ymax) == pytest.approx((-0.3, -0.1))
    assert (sides.zmin, sides.zmax) == pytest.approx((0.2, 1.8))


def test_the_box_of_a_turned_camera_keeps_its_turned_centre() -> None:
    turned = replace(AGI, camera=Pose2D(0.2, 0.1, math.pi / 4))

    (found,) = boxes("camera_link", robot=RobotDescription("AGI", profile=turned))

    assert found is not None
    x, y, _ = found.box.centre
    assert (x, y) == pytest.approx(turned.camera.transform(2.0, 0.25))


def test_a_box_without_a_frame_may_be_in_either() -> None:
    assert boxes(None) == boxes("base_link") + boxes("camera_link")


@pytest.mark.parametrize(
    "frame", ["map", "base_link", "camera_link", "camera_optical_frame"]
)
def test_a_box_without_a_frame_is_in_the_one_that_the_fleet_names(
    frame: Frame,
) -> None:
    named = RobotDescription("AGI", profile=replace(AGI, unlabelled_frame=frame))

    assert boxes(None, robot=named) == boxes(frame)


@pytest.mark.parametrize("frame_id", ["camera_link", "camera_optical_frame"])
def test_nobody_knows_the_place_of_a_camera_that_nobody_described(
    frame_id: str,
) -> None:
    assert CAUTIOUS.has_known_camera is False
    assert boxes(frame_id, robot=UNDESCRIBED) == [None]
    assert boxes(None, robot=UNDESCRIBED) == [*boxes("base_link"), None]
