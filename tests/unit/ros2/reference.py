"""rosbags as the reference codec; it has to be told the messages of detectors.

The definitions are those of their ``.msg`` files (``iveg/ros2/detector_messages.py``
names the sources), written a second time.
"""

from dataclasses import fields
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

_VISION_MSGS = {
    "ObjectHypothesis": "string class_id\nfloat64 score\n",
    "ObjectHypothesisWithPose": "ObjectHypothesis hypothesis\n"
    "geometry_msgs/PoseWithCovariance pose\n",
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n",
    "Detection3D": "std_msgs/Header header\nObjectHypothesisWithPose[] results\n"
    "BoundingBox3D bbox\nstring id\n",
    "Detection3DArray": "std_msgs/Header header\nDetection3D[] detections\n",
    "Point2D": "float64 x\nfloat64 y\n",
    "Pose2D": "Point2D position\nfloat64 theta\n",
    "BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "Detection2D": "std_msgs/Header header\nObjectHypothesisWithPose[] results\n"
    "BoundingBox2D bbox\nstring id\n",
    "Detection2DArray": "std_msgs/Header header\nDetection2D[] detections\n",
}
_BBOXES_EX_MSGS = {
    "BoundingBox": "float32 probability\nuint16 xmin\nuint16 ymin\nuint16 xmax\n"
    "uint16 ymax\nuint16 id\nuint16 img_width\nuint16 img_height\n"
    "int32 center_dist\nstring class_id\n",
    "BoundingBoxes": "std_msgs/Header header\nstd_msgs/Header image_header\n"
    "BoundingBox[] bounding_boxes\n",
}
_GB_MSGS = {
    "BoundingBox3d": "string object_name\nfloat64 probability\nfloat64 xmin\n"
    "float64 ymin\nfloat64 xmax\nfloat64 ymax\nfloat64 zmin\nfloat64 zmax\n",
    "BoundingBoxes3d": "std_msgs/Header header\nBoundingBox3d[] bounding_boxes\n",
}
_YOLO_MSGS = {
    "Point2D": "float64 x\nfloat64 y\n",
    "Vector2": "float64 x\nfloat64 y\n",
    "Pose2D": "yolo_msgs/Point2D position\nfloat64 theta\n",
    "BoundingBox2D": "yolo_msgs/Pose2D center\nyolo_msgs/Vector2 size\n",
    "BoundingBox3D": "geometry_msgs/Pose center\ngeometry_msgs/Vector3 size\n"
    "string frame_id\n",
    "Mask": "int32 height\nint32 width\nyolo_msgs/Point2D[] data\n",
    "KeyPoint2D": "int32 id\nyolo_msgs/Point2D point\nfloat64 score\n",
    "KeyPoint2DArray": "yolo_msgs/KeyPoint2D[] data\n",
    "KeyPoint3D": "int32 id\ngeometry_msgs/Point point\nfloat64 score\n",
    "KeyPoint3DArray": "yolo_msgs/KeyPoint3D[] data\nstring frame_id\n",
    "Detection": "int32 class_id\nstring class_name\nfloat64 score\nstring id\n"
    "yolo_msgs/BoundingBox2D bbox\nyolo_msgs/BoundingBox3D bbox3d\n"
    "yolo_msgs/Mask mask\nyolo_msgs/KeyPoint2DArray keypoints\n"
    "yolo_msgs/KeyPoint3DArray keypoints3d\n",
    "DetectionArray": "std_msgs/Header header\nyolo_msgs/Detection[] detections\n",
}
_PACKAGES = {
    "vision_msgs": _VISION_MSGS,
    "bboxes_ex_msgs": _BBOXES_EX_MSGS,
    "gb_visual_detection_3d_msgs": _GB_MSGS,
    "yolo_msgs": _YOLO_MSGS,
}


def _store() -> Any:
    store = get_typestore(Stores.ROS2_JAZZY)
    for package, messages in _PACKAGES.items():
        for name, text in messages.items():
            store.register(get_types_from_msg(text, f"{package}/msg/{name}"))
    return store


STORE: Any = _store()


def as_rosbags(value: Any) -> Any:
    """One of our messages as one of rosbags'."""
    if isinstance(value, tuple):
        return [as_rosbags(one) for one in value]
    if not hasattr(value, "ROS"):
        return np.array(value) if isinstance(value, np.ndarray) else value
    parts = {one.name: as_rosbags(getattr(value, one.name)) for one in fields(value)}
    return STORE.types[value.ROS](**parts)
