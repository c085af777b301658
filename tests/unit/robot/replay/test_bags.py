"""Bags of real robots: detectors of each family, transforms, and what is left out."""

import logging
import math
import re
import sqlite3
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from iveg.domain.errors import DataFileError
from iveg.domain.geometry import Pose2D
from iveg.domain.observations import DetectionFrame, LaserScan, Odometry
from iveg.robot.replay.bags import AS_RECORDED, BagOptions
from iveg.robot.replay.recordings import open_recording
from iveg.ros2 import detector_messages as d
from iveg.ros2 import geometry_msgs, nav_msgs, std_msgs
from iveg.ros2.schema import Message
from tests.data.message_bags import Said, message_bag, ros1_message_bag
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import WALL, link, tf
from tests.unit.robot.ros2.test_detectors import (
    CLOSE_M,
    MIDDLE,
    OPTICAL,
    TALL,
    TRUTH,
    UNSEEN,
    vision_2d,
    vision_3d,
    yolact,
    yolo_2d,
    yolo_3d,
    yolox,
    yolox_box,
)
from tests.unit.robot.ros2.test_pictures import depth, info

FLEET = Pose2D(0.5, 0.0, 0.0)
"""Where the fleet file says that the laser sits."""
PERSON = geometry_msgs.Point(0.0, 0.1, 3.0), geometry_msgs.Vector3(0.6, 1.8, 0.4)
"""In the camera's optical frame."""


def frames() -> list[Said]:
    """A robot at (10, 0) in map that looks east; its camera 1 m above the floor."""
    turned = geometry_msgs.Quaternion(-0.5, 0.5, -0.5, 0.5)
    camera = geometry_msgs.Transform(geometry_msgs.Vector3(-2.0, 0.0, 1.0), turned)
    base = std_msgs.Header(frame_id="base_link")
    at_camera = geometry_msgs.TransformStamped(base, OPTICAL.frame_id, camera)
    backwards = link("base_link", "laser", -0.3, yaw=math.pi)
    return [
        ("/tf_static", geometry_msgs.TFMessage((at_camera, backwards)), WALL),
        ("/tf", tf(link("map", "odom", 10.0)), WALL),
        ("/tf", tf(link("odom", "base_link", 2.0)), WALL),
    ]


def drive(seconds: float = 0.2) -> list[Said]:
    """Odometry at (2, 0), ten times a second."""
    return [
        ("/odom", said.odometry(2.0, 0.0, after=n / 10), WALL + n / 10)
        for n in range(round(seconds * 10) + 1)
    ]


def recorded(
    path: Path, said_: Sequence[Said], options: BagOptions = AS_RECORDED
) -> tuple[list[object], list[str]]:
    """Observations and the table of a bag."""
    lines: list[str] = []
    bag = message_bag(path / "run", said_)
    recording = open_recording(bag, FLEET, options, tell=lines.append)
    return [one.observation for one in recording()], lines


def fate(lines: Sequence[str], topic: str) -> str:
    (line,) = (one for one in lines if one.startswith(f"{topic} "))
    return re.split(r" {2,}", line, maxsplit=3)[3]


# --- transforms ---------------------------------------------------------------------


def test_a_laser_that_looks_back_is_drawn_looking_back(tmp_path: Path) -> None:
    scan = ("/scan", said.scan(), WALL)

    found, _ = recorded(tmp_path, [*frames(), *drive(), scan])

    (sweep,) = (one for one in found if isinstance(one, LaserScan))
    assert (sweep.mount.x, sweep.mount.y) == pytest.approx((-0.3, 0.0))
    assert abs(sweep.mount.yaw) == pytest.approx(math.pi)


def test_a_bag_of_ros_1_is_placed_by_its_transforms_too(tmp_path: Path) -> None:
    there = [*frames(), *drive(), ("/scan", said.scan(), WALL)]
    seen: Said = ("/yolact", box_3d(), WALL)
    lines: list[str] = []
    bag = ros1_message_bag(tmp_path / "run.bag", [*there, seen])

    entries = open_recording(bag, FLEET, tell=lines.append)()
    found = [one.observation for one in entries]

    (sweep,) = (one for one in found if isinstance(one, LaserScan))
    assert abs(sweep.mount.yaw) == pytest.approx(math.pi)
    assert {one.pose.x for one in found if isinstance(one, Odometry)} == {12.0}
    assert fate(lines, "/yolact") == (
        "ignored: of ROS 1 only odometry, scans and transforms are read"
    )


def test_a_laser_of_a_frame_that_the_bag_lacks_sits_where_the_fleet_says(
    tmp_path: Path,
) -> None:
    scan = ("/scan", said.scan(frame="front_laser"), WALL)

    found, _ = recorded(tmp_path, [*frames(), *drive(), scan])

    (sweep,) = (one for one in found if isinstance(one, LaserScan))
    assert sweep.mount == FLEET


def test_a_robot_is_where_the_map_of_the_bag_has_it(tmp_path: Path) -> None:
    found, _ = recorded(tmp_path, [*frames(), *drive()])

    assert {one.pose.x for one in found if isinstance(one, Odometry)} == {12.0}


def test_without_a_map_odometry_is_the_map(tmp_path: Path) -> None:
    there = [one for one in frames() if one[0] == "/tf_static"]

    found, _ = recorded(tmp_path, [*there, *drive(), ("/seen", box_3d(), WALL + 0.2)])

    (seen,) = (one for one in found if isinstance(one, DetectionFrame))
    assert {one.pose.x for one in found if isinstance(one, Odometry)} == {2.0}
    x, y, _ = seen.detections[0].box.centre
    assert math.dist((x, y), (TRUTH[0] - 10.0, 0.0)) <= CLOSE_M


def test_odometry_without_its_transform_is_skipped_counted_and_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    late = [("/odom", said.odometry(2.0, after=9.0), WALL + 9.0)]

    with caplog.at_level(logging.INFO):
        found, _ = recorded(tmp_path, [*frames(), *drive(), *late])

    assert len(found) == 3
    told = "\n".join(caplog.messages)
    assert "/odom: 1 not used: no_transform, map → odom" in told
    assert "/odom: 3 used" in told


# --- detectors ----------------------------------------------------------------------


def box_3d() -> Message:
    return yolact(OPTICAL, *PERSON)


CAMERA: list[Said] = [
    ("/camera/depth/image", depth(), WALL + 0.1),
    ("/camera/depth/camera_info", info(), WALL + 0.1),
]


@pytest.mark.parametrize(
    "message",
    [
        vision_3d(OPTICAL, *PERSON),
        yolact(OPTICAL, *PERSON),
        yolo_3d(OPTICAL, *PERSON),
        vision_2d(MIDDLE, TALL),
        yolox(MIDDLE, TALL),
        yolo_2d(MIDDLE, TALL),
    ],
    ids=lambda one: one.ROS,
)
@pytest.mark.parametrize("mcap", [True, False])
def test_a_detector_of_each_family_sees_the_person_where_it_is(
    message: Message, mcap: bool, tmp_path: Path
) -> None:
    seen = ("/detector", message, WALL + 0.1)
    bag = message_bag(
        tmp_path / "run", [*frames(), *drive(), *CAMERA, seen, *drive()], mcap=mcap
    )

    found = list(open_recording(bag, FLEET)())

    (frame,) = (one for one in found if isinstance(one.observation, DetectionFrame))
    assert isinstance(frame.observation, DetectionFrame)
    (one,) = frame.observation.detections
    assert (one.class_id, one.frame_id) == ("farmer", "map")
    assert math.dist(one.box.centre[:2], TRUTH) <= CLOSE_M
    assert frame.at == pytest.approx(0.0)


def test_a_look_at_nobody_is_an_empty_frame(tmp_path: Path) -> None:
    seen = ("/yolact_coordinate", d.BoundingBoxes3d(OPTICAL), WALL)

    found, _ = recorded(tmp_path, [*frames(), *drive(), seen])

    (frame,) = (one for one in found if isinstance(one, DetectionFrame))
    assert (frame.detections, frame.unread) == ((), ())


def test_a_person_whose_frame_the_bag_lacks_is_lost_and_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    seen = ("/seen", yolact(std_msgs.Header(said.stamp(), "left_eye"), *PERSON), WALL)

    found, _ = recorded(tmp_path, [*frames(), *drive(), seen])

    (frame,) = (one for one in found if isinstance(one, DetectionFrame))
    assert (frame.detections, frame.unread) == ((), ("farmer",))
    (told,) = caplog.messages
    assert told.endswith("/seen: 1 not used: no_transform, map → left_eye")


def test_of_detectors_the_one_with_depth_is_read(tmp_path: Path) -> None:
    seen = [
        ("/yolox/bounding_box", yolox(MIDDLE, TALL), WALL),
        ("/yolact_coordinate", box_3d(), WALL),
    ]

    _, lines = recorded(tmp_path, [*frames(), *drive(), *CAMERA, *seen])

    assert fate(lines, "/yolact_coordinate") == "detections"
    assert fate(lines, "/yolox/bounding_box") == "ignored: another detector is read"
    assert fate(lines, "/camera/depth/image") == "ignored: no boxes need it"


def test_a_detector_that_is_named_is_the_one_that_is_read(tmp_path: Path) -> None:
    seen = [
        ("/yolox/bounding_box", yolox(MIDDLE, TALL), WALL),
        ("/yolact_coordinate", box_3d(), WALL),
    ]
    named = BagOptions(detections="/yolox/bounding_box")

    _, lines = recorded(tmp_path, [*frames(), *drive(), *CAMERA, *seen], named)

    assert fate(lines, "/yolox/bounding_box") == "detections"
    assert fate(lines, "/camera/depth/image") == "depth"
    assert fate(lines, "/yolact_coordinate").startswith("ignored: ")


@pytest.mark.parametrize(
    ("named", "why"),
    [
        (BagOptions(detections="/gone"), "--detections-topic /gone is not among"),
        (BagOptions(depth="/gone"), r"--depth-topic /gone .*: /camera/depth/image\.$"),
        (BagOptions(camera_info="/gone"), "--camera-info-topic /gone is not among"),
    ],
)
def test_a_topic_that_is_named_must_be_there(
    named: BagOptions, why: str, tmp_path: Path
) -> None:
    seen = ("/yolox/bounding_box", yolox(MIDDLE, TALL), WALL)

    with pytest.raises(DataFileError, match=why):
        recorded(tmp_path, [*drive(), *CAMERA, seen], named)


def test_two_detectors_with_depth_leave_open_which_is_meant(tmp_path: Path) -> None:
    seen = [("/left", box_3d(), WALL), ("/right", box_3d(), WALL)]

    with pytest.raises(DataFileError, match=r"--detections-topic must .*/left, /right"):
        recorded(tmp_path, [*drive(), *seen])


# --- what is ignored ----------------------------------------------------------------


def test_the_table_tells_of_every_topic_what_becomes_of_it(tmp_path: Path) -> None:
    seen = [
        ("/scan", said.scan(), WALL),
        ("/yolox/bounding_box", yolox(MIDDLE, TALL), WALL),
        ("/plan", nav_msgs.Path(), WALL),
    ]

    _, lines = recorded(tmp_path, [*frames(), *drive(), *seen])

    assert lines[0].endswith("run:")
    read = ["/odom", "/scan", "/tf", "/tf_static"]
    roles = ["odometry", "scan", "tf", "tf_static"]
    assert [fate(lines, topic) for topic in read] == roles
    assert fate(lines, "/yolox/bounding_box") == (
        "ignored: boxes in a picture; no --depth-topic with its --camera-info-topic"
    )
    assert fate(lines, "/plan") == (
        "ignored: of no use here (std_msgs/Header header, "
        "geometry_msgs/PoseStamped[] poses)"
    )
    (odom,) = (one for one in lines if one.startswith("/odom "))
    assert odom.split() == ["/odom", "nav_msgs/msg/Odometry", "3", "odometry"]


def test_a_type_of_the_same_name_with_other_fields_is_named_by_its_hash(
    tmp_path: Path,
) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in (
        ("BoundingBox", "float64 probability\nstring class_id\n"),
        ("BoundingBoxes", "std_msgs/Header header\nBoundingBox[] bounding_boxes\n"),
    ):
        store.register(get_types_from_msg(text, f"bboxes_ex_msgs/msg/{name}"))
    lines: list[str] = []
    seen: list[Said] = [("/yolox", d.BoundingBoxes(OPTICAL), WALL)]
    bag = message_bag(tmp_path / "run", [*drive(), *seen], store=store)

    open_recording(bag, FLEET, tell=lines.append)

    digest = store.hash_rihs01("bboxes_ex_msgs/msg/BoundingBoxes")
    assert fate(lines, "/yolox") == f"ignored: another definition, {digest}"


def test_a_bag_that_lost_half_of_its_types_is_read_as_far_as_it_goes(
    tmp_path: Path,
) -> None:
    """Recorders before Iron write no definitions; those here name no type at all."""
    seen = [("/seen", box_3d(), WALL + 0.3), ("/scan", said.scan(), WALL)]
    everything = [*frames(), *drive(), *seen]
    bag = message_bag(tmp_path / "run", everything, mcap=False) / "run.db3"
    with sqlite3.connect(bag) as base:
        base.execute("DELETE FROM message_definitions")
        base.execute("UPDATE topics SET type='lost/msg/Type' WHERE name='/scan'")
        base.execute("UPDATE topics SET type='lost/msg/Type' WHERE name='/tf'")
    base.close()
    lines: list[str] = []

    found = [one.observation for one in open_recording(bag, FLEET, tell=lines.append)()]

    assert [type(one) for one in found] == [Odometry] * 3 + [DetectionFrame]
    assert fate(lines, "/scan") == fate(lines, "/tf") == "ignored: of no use here"


def test_a_bag_of_a_format_to_come_is_refused_in_one_sentence(tmp_path: Path) -> None:
    bag = message_bag(tmp_path / "run", drive())
    about = bag / "metadata.yaml"
    about.write_text(about.read_text().replace("version: 9", "version: 99"))

    with pytest.raises(
        DataFileError, match=r"run: cannot be read: .*version 99"
    ) as told:
        open_recording(bag, FLEET)

    assert "\n" not in str(told.value)


def test_a_bag_of_a_day_to_come_plays_and_says_so_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    later = 2_140_000_000.0
    message = said.odometry()
    message = replace(message, header=std_msgs.Header(std_msgs.Time.of(later), "odom"))
    bag = message_bag(tmp_path / "run", [("/odom", message, later)])

    found = list(open_recording(bag, FLEET)())

    assert [one.at for one in found] == [0.0]
    (told,) = caplog.messages
    assert "is of 2037-10-24, which is still to come" in told


def test_a_bag_that_breaks_off_among_its_detections_says_so(tmp_path: Path) -> None:
    seen: list[Said] = [
        (
            "/seen",
            d.BoundingBoxes(OPTICAL, UNSEEN, (yolox_box(MIDDLE, TALL),) * 9),
            WALL,
        )
    ]
    bag = message_bag(tmp_path / "run", [*drive(30.0), *seen * 400])
    file = bag / "run.mcap"
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])

    with pytest.raises(DataFileError, match=r"run: cannot be read: "):
        list(open_recording(bag, FLEET)())
