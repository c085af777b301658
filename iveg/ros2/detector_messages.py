"""Messages of detectors beside ``vision_msgs``, by their short names."""

from typing import Any

from iveg.ros2.messages import short_named

_PACKAGES = "yolo_msgs", "bboxes_ex_msgs", "gb_visual_detection_3d_msgs"


def __getattr__(name: str) -> Any:
    """The class of a message by its short name, made at its first use."""
    made = globals()[name] = short_named(name, _PACKAGES)
    return made
