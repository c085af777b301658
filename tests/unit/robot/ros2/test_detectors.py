"""Detectors join unchanged: messages of each family, as rosbags writes them."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from iveg.domain.observations import DetectionFrame
from iveg.robot.ros2.config import RobotConfig
from iveg.ros2 import cdr, geometry_msgs, std_msgs, vision_msgs
from iveg.ros2 import detector_messages as d
from iveg.ros2.schema import Message
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import MONO, Bench, tf
from tests.unit.robot.ros2.test_pictures import HEIGHT, TOPICS, WIDTH, depth, info
from tests.unit.ros2.reference import STORE, as_rosbags

TRUTH = (13.0, 0.0)
"""Where the person stands in map (m): 3 m before a camera that is at (10, 0, 1) and
looks east; ``test_pictures`` draws the same person."""
OPTICAL = std_msgs.Header(said.stamp(), "camera_optical")
UNSEEN = std_msgs.Header()
CLOSE_M = 0.1


def bench(classes: tuple[str, ...] = ()) -> Bench:
    found = Bench(RobotConfig(topics=TOPICS), tree=False, classes=classes)
    optical = geometry_msgs.Quaternion(-0.5, 0.5, -0.5, 0.5)
    place = geometry_msgs.Transform(geometry_msgs.Vector3(10.0, 0.0, 1.0), optical)
    links = (
        geometry_msgs.TransformStamped(
            std_msgs.Header(said.stamp(), "map"), "camera_optical", place
        ),
        said.link("map", "base_link", 11.0, 1.0, math.pi / 2),
    )
    found.hear("tf_static", tf(*links))
    return found


def told(one: Bench, topic: str, message: Message) -> DetectionFrame:
    """What follows from a message that another encoder wrote."""
    wire = bytes(STORE.serialize_cdr(as_rosbags(message), message.ROS))
    one.inputs.hear(topic, [wire], MONO, form=type(message))
    (found,) = one.tick()
    assert isinstance(found, DetectionFrame)
    return found


def sure(name: str = "farmer") -> tuple[vision_msgs.ObjectHypothesisWithPose, ...]:
    return (
        vision_msgs.ObjectHypothesisWithPose(vision_msgs.ObjectHypothesis(name, 0.9)),
    )


# --- with depth ---------------------------------------------------------------------


def vision_3d(
    header: std_msgs.Header, centre: geometry_msgs.Point, size: geometry_msgs.Vector3
) -> Message:
    box = vision_msgs.BoundingBox3D(geometry_msgs.Pose(centre), size)
    return vision_msgs.Detection3DArray(
        header, (vision_msgs.Detection3D(UNSEEN, sure(), box),)
    )


def yolact(
    header: std_msgs.Header, centre: geometry_msgs.Point, size: geometry_msgs.Vector3
) -> Message:
    x, y, z = centre.x, centre.y, centre.z
    u, v, w = size.x / 2, size.y / 2, size.z / 2
    box = d.BoundingBox3d("farmer", 0.9, x - u, y - v, x + u, y + v, z - w, z + w)
    return d.BoundingBoxes3d(header, (box,))


def yolo_3d(
    header: std_msgs.Header, centre: geometry_msgs.Point, size: geometry_msgs.Vector3
) -> Message:
    box = d.BoundingBox3D(geometry_msgs.Pose(centre), size, header.frame_id)
    one = d.Detection(0, "farmer", 0.9, "4", bbox3d=box)
    return d.DetectionArray(std_msgs.Header(header.stamp, "elsewhere"), (one,))


Made = Callable[[std_msgs.Header, geometry_msgs.Point, geometry_msgs.Vector3], Message]


@pytest.mark.parametrize("made", [vision_3d, yolact, yolo_3d])
@pytest.mark.parametrize(
    ("frame", "centre", "size"),
    [
        (
            "camera_optical",
            geometry_msgs.Point(0.0, 0.1, 3.0),
            geometry_msgs.Vector3(0.6, 1.8, 0.4),
        ),
        (
            "base_link",
            geometry_msgs.Point(-1.0, -2.0, 0.9),
            geometry_msgs.Vector3(0.6, 0.4, 1.8),
        ),
        (
            "/map",
            geometry_msgs.Point(13.0, 0.0, 0.9),
            geometry_msgs.Vector3(0.4, 0.6, 1.8),
        ),
    ],
)
def test_a_box_with_depth_lies_where_the_person_is(
    made: Made, frame: str, centre: geometry_msgs.Point, size: geometry_msgs.Vector3
) -> None:
    header = std_msgs.Header(said.stamp(), frame)

    (one,) = told(bench(), "detections_3d", made(header, centre, size)).detections

    assert (one.class_id, one.probability) == ("farmer", 0.9)
    assert math.dist(one.box.centre[:2], TRUTH) <= CLOSE_M
    assert one.box.zmin == pytest.approx(0.0, abs=0.01)
    assert one.box.zmax == pytest.approx(1.8, abs=0.01)


@pytest.mark.parametrize("made", [vision_3d, yolact, yolo_3d])
def test_a_frame_that_nobody_knows_places_nothing_and_is_named(made: Made) -> None:
    one = bench()
    header = std_msgs.Header(said.stamp(), "left_eye")

    found = told(
        one,
        "detections_3d",
        made(header, geometry_msgs.Point(1.0), geometry_msgs.Vector3(1, 1, 1)),
    )

    assert (found.detections, found.unread) == ((), ("farmer",))
    assert one.faults() == {"no_transform": "map → left_eye"}


def test_a_detection_of_yolo_without_depth_is_no_place_at_the_origin() -> None:
    seen = d.DetectionArray(OPTICAL, (d.Detection(0, "farmer", 0.9),))

    found = told(bench(), "detections_3d", seen)

    assert (found.detections, found.unread) == ((), ("farmer",))


# --- in a picture -------------------------------------------------------------------


def vision_2d(centre: vision_msgs.Point2D, size: vision_msgs.Point2D) -> Message:
    box = vision_msgs.BoundingBox2D(vision_msgs.PicturePose(centre), size.x, size.y)
    return vision_msgs.Detection2DArray(
        OPTICAL, (vision_msgs.Detection2D(UNSEEN, sure(), box),)
    )


def yolox_box(centre: vision_msgs.Point2D, size: vision_msgs.Point2D) -> d.BoundingBox:
    # A number below zero loses its sign, as in the detector's own uint16.
    return d.BoundingBox(
        0.9,
        int(centre.x - size.x / 2) % 65536,
        int(centre.y - size.y / 2) % 65536,
        int(centre.x + size.x / 2),
        int(centre.y + size.y / 2),
        3,
        WIDTH,
        HEIGHT,
        class_id="farmer",
    )


def yolox(centre: vision_msgs.Point2D, size: vision_msgs.Point2D) -> Message:
    return d.BoundingBoxes(OPTICAL, UNSEEN, (yolox_box(centre, size),))


def yolo_2d(centre: vision_msgs.Point2D, size: vision_msgs.Point2D) -> Message:
    place = d.Pose2D(d.Point2D(centre.x, centre.y))
    box = d.BoundingBox2D(place, d.Vector2(size.x, size.y))
    return d.DetectionArray(OPTICAL, (d.Detection(0, "farmer", 0.9, bbox=box),))


Drawn = Callable[[vision_msgs.Point2D, vision_msgs.Point2D], Message]
MIDDLE, TALL = vision_msgs.Point2D(32.0, 25.0), vision_msgs.Point2D(20.0, 34.0)


@pytest.mark.parametrize("drawn", [vision_2d, yolox, yolo_2d])
@pytest.mark.parametrize(
    ("centre", "size"),
    [
        (MIDDLE, TALL),
        (vision_msgs.Point2D(32.0, 17.0), vision_msgs.Point2D(20.0, 46.0)),
    ],
    ids=["within the picture", "over its upper edge"],
)
def test_a_box_in_a_picture_lies_where_the_person_is(
    drawn: Drawn, centre: vision_msgs.Point2D, size: vision_msgs.Point2D
) -> None:
    one = bench().hear("depth", depth()).hear("camera_info", info())

    (found,) = told(one, "detections_2d", drawn(centre, size)).detections

    assert found.class_id == "farmer"
    assert found.probability == pytest.approx(0.9)
    assert math.dist(found.box.centre[:2], TRUTH) <= CLOSE_M


def test_the_picture_that_yolox_looked_at_is_the_one_that_counts() -> None:
    """Some builds put the time of publishing into the first header."""
    late = std_msgs.Header(said.stamp(0.2), "")
    seen = d.BoundingBoxes(late, OPTICAL, (yolox_box(MIDDLE, TALL),))
    one = bench().hear("depth", depth()).hear("camera_info", info())

    (found,) = told(one, "detections_2d", seen).detections

    assert math.dist(found.box.centre[:2], TRUTH) <= CLOSE_M


def test_boxes_in_a_picture_of_another_size_are_lost_and_named() -> None:
    box = replace(yolox_box(MIDDLE, TALL), img_width=1280, img_height=720)
    one = bench().hear("depth", depth()).hear("camera_info", info())

    found = told(one, "detections_2d", d.BoundingBoxes(OPTICAL, UNSEEN, (box,)))

    assert (found.detections, found.unread) == ((), ("farmer",))
    assert one.faults() == {"bad_picture": "/depth"}


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        ("detections_2d", d.BoundingBoxes(OPTICAL)),
        ("detections_2d", d.DetectionArray(OPTICAL)),
        ("detections_3d", d.BoundingBoxes3d(OPTICAL)),
        ("detections_3d", d.DetectionArray(OPTICAL)),
    ],
)
def test_a_picture_with_nobody_in_it_is_an_empty_frame(
    topic: str, message: Message
) -> None:
    one = bench().hear("depth", depth()).hear("camera_info", info())

    found = told(one, topic, message)

    assert (found.detections, found.unread) == ((), ())


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        ("detections_2d", d.BoundingBoxes(OPTICAL, UNSEEN, (
            replace(yolox_box(MIDDLE, TALL), class_id="1"),))),
        ("detections_3d", d.DetectionArray(OPTICAL, (d.Detection(1, "", 0.9, "", bbox3d=
            d.BoundingBox3D(geometry_msgs.Pose(geometry_msgs.Point(z=3.0)),
                            frame_id="camera_optical")),))),
    ],
)  # fmt: skip
def test_a_class_that_is_a_number_gets_its_name(topic: str, message: Any) -> None:
    one = bench(("person", "farmer"))
    one.hear("depth", depth()).hear("camera_info", info())

    (found,) = told(one, topic, message).detections

    assert found.class_id == "farmer"


@pytest.mark.parametrize("score", [math.nan, -0.1, 1.5])
def test_a_score_that_is_none_is_lost(score: float) -> None:
    box = d.BoundingBox3d("farmer", score, -0.3, -0.9, 0.3, 0.9, 2.8, 3.2)
    one = bench()

    found = told(one, "detections_3d", d.BoundingBoxes3d(OPTICAL, (box,)))

    assert (found.detections, len(found.unread)) == ((), 1)
    assert one.faults() == {"bad_probability": "/detections_3d"}


@pytest.mark.parametrize(
    "message",
    [
        yolox(MIDDLE, TALL),
        yolact(OPTICAL, geometry_msgs.Point(1.0), geometry_msgs.Vector3(1.0, 2.0, 3.0)),
        yolo_3d(
            OPTICAL, geometry_msgs.Point(1.0), geometry_msgs.Vector3(1.0, 2.0, 3.0)
        ),
        d.DetectionArray(
            OPTICAL,
            (
                d.Detection(
                    mask=d.Mask(1, 2, (d.Point2D(3.0, 4.0),)),
                    keypoints=d.KeyPoint2DArray((d.KeyPoint2D(1),)),
                    keypoints3d=d.KeyPoint3DArray((d.KeyPoint3D(1),), "here"),
                ),
            ),
        ),
    ],
    ids=lambda one: one.ROS,
)
def test_a_message_has_the_bytes_that_rosbags_writes(message: Message) -> None:
    wire = bytes(STORE.serialize_cdr(as_rosbags(message), message.ROS))

    assert cdr.write(message) == wire
    assert cdr.write(cdr.read(type(message), wire)) == wire
