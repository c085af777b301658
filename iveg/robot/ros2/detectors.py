"""Detections of each family of messages, as those of ``vision_msgs``.

A box of a picture that lies over its left or upper edge comes from YOLOX-ROS as a
negative number in 16 bits without a sign.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from iveg.ros2 import detector_messages as d
from iveg.ros2 import geometry_msgs, std_msgs, vision_msgs
from iveg.ros2.schema import Message

_SIGN, _WRAP = 1 << 15, 1 << 16


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Detections of one picture, without depth.

    Attributes:
        header: Of the picture.
        width: Of the picture (pixels), ``height`` likewise; 0: not told.
    """

    header: std_msgs.Header
    detections: tuple[vision_msgs.Detection2D, ...]
    width: int = 0
    height: int = 0


def _vision(look: vision_msgs.Detection2DArray) -> Look:
    return Look(look.header, look.detections)


def _yolox(look: d.BoundingBoxes) -> Look:
    boxes, own = look.bounding_boxes, look.image_header
    header = own if own.frame_id or own.stamp != std_msgs.Time() else look.header
    width = max((one.img_width for one in boxes), default=0)
    height = max((one.img_height for one in boxes), default=0)
    return Look(header, tuple(map(_yolox_box, boxes)), width, height)


def _yolox_box(one: d.BoundingBox) -> vision_msgs.Detection2D:
    xmin, ymin, xmax, ymax = (
        float(edge - _WRAP if edge >= _SIGN else edge)
        for edge in (one.xmin, one.ymin, one.xmax, one.ymax)
    )
    centre = vision_msgs.Point2D((xmin + xmax) / 2, (ymin + ymax) / 2)
    box = vision_msgs.BoundingBox2D(
        vision_msgs.PicturePose(centre), xmax - xmin, ymax - ymin
    )
    return vision_msgs.Detection2D(
        std_msgs.Header(), _sure(one.class_id, one.probability), box
    )


def _yolo(look: d.DetectionArray) -> Look:
    return Look(look.header, tuple(map(_yolo_box, look.detections)))


def _yolo_box(one: d.Detection) -> vision_msgs.Detection2D:
    centre, size = one.bbox.center, one.bbox.size
    place = vision_msgs.PicturePose(
        vision_msgs.Point2D(centre.position.x, centre.position.y), centre.theta
    )
    box = vision_msgs.BoundingBox2D(place, size.x, size.y)
    return vision_msgs.Detection2D(std_msgs.Header(), _yolo_class(one), box, one.id)


def _yolo_3d(found: d.DetectionArray) -> vision_msgs.Detection3DArray:
    return vision_msgs.Detection3DArray(
        found.header, tuple(map(_yolo_box_3d, found.detections))
    )


def _yolo_box_3d(one: d.Detection) -> vision_msgs.Detection3D:
    box = one.bbox3d
    # Without a frame no node has added depth, and zeros are no place.
    centre = (
        box.center
        if box.frame_id
        else geometry_msgs.Pose(geometry_msgs.Point(math.nan))
    )
    header = std_msgs.Header(frame_id=box.frame_id)
    found = vision_msgs.BoundingBox3D(centre, box.size)
    return vision_msgs.Detection3D(header, _yolo_class(one), found, one.id)


def _yolo_class(one: d.Detection) -> tuple[vision_msgs.ObjectHypothesisWithPose, ...]:
    return _sure(one.class_name or str(one.class_id), one.score)


def _yolact(found: d.BoundingBoxes3d) -> vision_msgs.Detection3DArray:
    return vision_msgs.Detection3DArray(
        found.header, tuple(map(_yolact_box, found.bounding_boxes))
    )


def _yolact_box(one: d.BoundingBox3d) -> vision_msgs.Detection3D:
    centre = geometry_msgs.Point(
        (one.xmin + one.xmax) / 2,
        (one.ymin + one.ymax) / 2,
        (one.zmin + one.zmax) / 2,
    )
    size = geometry_msgs.Vector3(
        one.xmax - one.xmin, one.ymax - one.ymin, one.zmax - one.zmin
    )
    box = vision_msgs.BoundingBox3D(geometry_msgs.Pose(centre), size)
    return vision_msgs.Detection3D(
        std_msgs.Header(), _sure(one.object_name, one.probability), box
    )


def _sure(
    class_id: str, score: float
) -> tuple[vision_msgs.ObjectHypothesisWithPose, ...]:
    return (
        vision_msgs.ObjectHypothesisWithPose(
            vision_msgs.ObjectHypothesis(class_id, score)
        ),
    )


LOOKS: Mapping[type[Message], Callable[[Any], Look]] = {
    vision_msgs.Detection2DArray: _vision,
    d.BoundingBoxes: _yolox,
    d.DetectionArray: _yolo,
}
"""Boxes in a picture, by type; they need its depth."""

BOXES: Mapping[type[Message], Callable[[Any], vision_msgs.Detection3DArray]] = {
    vision_msgs.Detection3DArray: lambda found: found,
    d.BoundingBoxes3d: _yolact,
    d.DetectionArray: _yolo_3d,
}
"""Boxes with a place, by type."""
