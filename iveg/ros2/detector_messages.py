"""Messages of detectors beside ``vision_msgs``."""

from typing import Any

from iveg.ros2.messages import NEWER_STORE, message

BoundingBox: Any = message("bboxes_ex_msgs/msg/BoundingBox")
NumberedBoundingBox: Any = message("bboxes_ex_msgs/msg/BoundingBox", NEWER_STORE)
NumberedBoundingBoxes: Any = message("bboxes_ex_msgs/msg/BoundingBoxes", NEWER_STORE)
"""Boxes of one picture as since July 2022."""
BoundingBoxes: Any = message(
    "bboxes_ex_msgs/msg/BoundingBoxes", newer=NumberedBoundingBoxes
)
"""Boxes of one picture; YOLOX-ROS puts the picture's header into ``header``."""
BoundingBox3d: Any = message("gb_visual_detection_3d_msgs/msg/BoundingBox3d")
BoundingBoxes3d: Any = message("gb_visual_detection_3d_msgs/msg/BoundingBoxes3d")
Point2D: Any = message("yolo_msgs/msg/Point2D")
Vector2: Any = message("yolo_msgs/msg/Vector2")
Pose2D: Any = message("yolo_msgs/msg/Pose2D")
BoundingBox2D: Any = message("yolo_msgs/msg/BoundingBox2D")
BoundingBox3D: Any = message("yolo_msgs/msg/BoundingBox3D")
Detection: Any = message("yolo_msgs/msg/Detection")
DetectionArray: Any = message("yolo_msgs/msg/DetectionArray")
