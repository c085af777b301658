"""rosbags as the reference decoder; ``vision_msgs`` it has to be told."""

from dataclasses import fields
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

_VISION = {
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


def _store() -> Any:
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in _VISION.items():
        store.register(get_types_from_msg(text, f"vision_msgs/msg/{name}"))
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
