"""Detectors join unchanged: messages of each family."""

import math
from collections.abc import Callable
from typing import Any

import pytest

from iveg.domain.observations import DetectionFrame
from iveg.ros2 import cdr
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message
from tests.unit.robot.ros2 import said
from tests.unit.robot.ros2.said import MONO, tf
from tests.unit.robot.ros2.test_pictures import (
    HEIGHT,
    MIDDLE,
    OPTICAL,
    TALL,
    WIDTH,
    bench,
    depth,
    look,
)

TRUTH = (13.0, 0.0)
"""Where the person stands in map (m): 3 m before a camera that is at (10, 0, 1) and
looks east; ``test_pictures`` draws the same person."""
UNSEEN = ros.Header()
CLOSE_M = 0.1


def told(
    topic: str, message: Message, form: type[Message] | None = None
) -> DetectionFrame:
    """What follows from a message, of a camera with depth."""
    base = said.link("map", "base_link", 11.0, 1.0, math.pi / 2)
    one = bench().hear("tf_static", tf(base)).hear("depth", depth())
    one.inputs.receive(topic, [cdr.write(message)], MONO, form or type(message))
    return one.only(DetectionFrame)


# --- with depth ---------------------------------------------------------------------


def vision_3d(header: ros.Header, centre: ros.Point, size: ros.Vector3) -> Any:
    sure = ros.ObjectHypothesisWithPose(ros.ObjectHypothesis("farmer", 0.9))
    box = ros.BoundingBox3D(ros.Pose(centre), size)
    return ros.Detection3DArray(header, (ros.Detection3D(UNSEEN, (sure,), box),))


def yolact(header: ros.Header, centre: ros.Point, size: ros.Vector3) -> Any:
    x, y, z = centre.x, centre.y, centre.z
    u, v, w = size.x / 2, size.y / 2, size.z / 2
    box = d.BoundingBox3d("farmer", 0.9, x - u, y - v, x + u, y + v, z - w, z + w)
    return d.BoundingBoxes3d(header, (box,))


def yolo_3d(header: ros.Header, centre: ros.Point, size: ros.Vector3) -> Any:
    box = d.BoundingBox3D(ros.Pose(centre), size, header.frame_id)
    one = d.Detection(0, "farmer", 0.9, "4", bbox3d=box)
    return d.DetectionArray(ros.Header(header.stamp, "elsewhere"), (one,))


Made = Callable[[ros.Header, ros.Point, ros.Vector3], Message]


@pytest.mark.parametrize("made", [vision_3d, yolact, yolo_3d])
@pytest.mark.parametrize(
    ("frame", "centre", "size"),
    [
        ("camera_optical", ros.Point(0.0, 0.1, 3.0), ros.Vector3(0.6, 1.8, 0.4)),
        ("base_link", ros.Point(-1.0, -2.0, 0.9), ros.Vector3(0.6, 0.4, 1.8)),
        ("/map", ros.Point(13.0, 0.0, 0.9), ros.Vector3(0.4, 0.6, 1.8)),
    ],
)
def test_a_box_with_depth_lies_where_the_person_is(
    made: Made, frame: str, centre: ros.Point, size: ros.Vector3
) -> None:
    header = ros.Header(said.stamp(), frame)

    (one,) = told("detections_3d", made(header, centre, size)).detections

    assert (one.class_id, one.probability) == ("farmer", 0.9)
    assert math.dist(one.box.centre[:2], TRUTH) <= CLOSE_M
    assert one.box.zmin == pytest.approx(0.0, abs=0.01)
    assert one.box.zmax == pytest.approx(1.8, abs=0.01)


def test_a_detection_of_yolo_without_depth_is_no_place_at_the_origin() -> None:
    seen = d.DetectionArray(OPTICAL, (d.Detection(0, "farmer", 0.9),))

    found = told("detections_3d", seen)

    assert (found.detections, found.unread) == ((), ("farmer",))


# --- in a picture -------------------------------------------------------------------


def yolox_box(centre: ros.Point2D, size: ros.Point2D) -> d.BoundingBox:
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


def yolox(centre: ros.Point2D, size: ros.Point2D) -> Any:
    return d.BoundingBoxes(OPTICAL, UNSEEN, (yolox_box(centre, size),))


def yolo_2d(centre: ros.Point2D, size: ros.Point2D) -> Any:
    place = d.Pose2D(d.Point2D(centre.x, centre.y))
    box = d.BoundingBox2D(place, d.Vector2(size.x, size.y))
    return d.DetectionArray(OPTICAL, (d.Detection(0, "farmer", 0.9, bbox=box),))


Drawn = Callable[[ros.Point2D, ros.Point2D], Message]


@pytest.mark.parametrize("drawn", [look, yolox, yolo_2d])
@pytest.mark.parametrize(
    ("centre", "size"),
    [(MIDDLE, TALL), (ros.Point2D(32.0, 17.0), ros.Point2D(20.0, 46.0))],
    ids=["within the picture", "over its upper edge"],
)
def test_a_box_in_a_picture_lies_where_the_person_is(
    drawn: Drawn, centre: ros.Point2D, size: ros.Point2D
) -> None:
    (found,) = told("detections_2d", drawn(centre, size)).detections

    assert found.class_id == "farmer"
    assert found.probability == pytest.approx(0.9)
    assert math.dist(found.box.centre[:2], TRUTH) <= CLOSE_M


def test_the_picture_that_yolox_looked_at_is_the_one_that_counts() -> None:
    """Some builds put the time of publishing into the first header."""
    late = ros.Header(said.stamp(0.2), "")
    seen = d.BoundingBoxes(late, OPTICAL, (yolox_box(MIDDLE, TALL),))

    (found,) = told("detections_2d", seen).detections

    assert math.dist(found.box.centre[:2], TRUTH) <= CLOSE_M


@pytest.mark.parametrize(
    ("topic", "message"),
    [
        ("detections_2d", d.BoundingBoxes(OPTICAL)),
        ("detections_2d", d.DetectionArray(OPTICAL)),
        ("detections_3d", ros.Detection3DArray(OPTICAL)),
        ("detections_3d", d.BoundingBoxes3d(OPTICAL)),
        ("detections_3d", d.DetectionArray(OPTICAL)),
    ],
)
def test_a_picture_with_nobody_in_it_is_an_empty_frame(
    topic: str, message: Message
) -> None:
    found = told(topic, message)

    assert (found.detections, found.unread) == ((), ())
