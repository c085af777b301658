"""Messages of detectors beside ``vision_msgs``, by their short names."""

from typing import Any

from iveg.ros2.messages import NEWER_STORE, message, short_named

_PACKAGES = "yolo_msgs", "bboxes_ex_msgs", "gb_visual_detection_3d_msgs"
NumberedBoundingBox: Any = message("bboxes_ex_msgs/msg/BoundingBox", NEWER_STORE)
NumberedBoundingBoxes: Any = message("bboxes_ex_msgs/msg/BoundingBoxes", NEWER_STORE)
"""Boxes of one picture as since July 2022."""
BoundingBoxes: Any = message(
    "bboxes_ex_msgs/msg/BoundingBoxes", newer=NumberedBoundingBoxes
)
"""Boxes of one picture; YOLOX-ROS puts the picture's header into ``header``."""


def __getattr__(name: str) -> Any:
    """The class of a message by its short name, made at its first use."""
    made = globals()[name] = short_named(name, _PACKAGES)
    return made
