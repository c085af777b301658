"""Messages of ROS 2 by rosbags: classes whose fields are zero unless given.

Names and fields are those of ROS, in ROS's order; units are those of REP-103.
"""

import math
from abc import ABC
from collections.abc import Iterable
from dataclasses import dataclass, field, make_dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# --- definitions ------------------------------------------------------------------
#
# Definitions of messages of detectors, which rosbags lacks; sources: their packages.
#
# ``vision_msgs`` 4, ``bboxes_ex_msgs`` (Ar-Ray-code, the messages of YOLOX-ROS),
# ``gb_visual_detection_3d_msgs`` (IntelligentRoboticsLabs, master of 2020, ROS 2) and
# ``yolo_msgs`` (mgonzs13/yolo_ros, 2026); forks with other fields have another type
# hash.

_TEXTS = {
    "vision_msgs/msg/ObjectHypothesis": "string class_id\nfloat64 score\n",
    "vision_msgs/msg/ObjectHypothesisWithPose": "ObjectHypothesis hypothesis\n"
    "geometry_msgs/PoseWithCovariance pose\n",
    "vision_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\n"
    "geometry_msgs/Vector3 size\n",
    "vision_msgs/msg/Detection3D": "std_msgs/Header header\n"
    "ObjectHypothesisWithPose[] results\nBoundingBox3D bbox\nstring id\n",
    "vision_msgs/msg/Detection3DArray": "std_msgs/Header header\n"
    "Detection3D[] detections\n",
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "vision_msgs/msg/Pose2D": "Point2D position\nfloat64 theta\n",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\n"
    "float64 size_y\n",
    "vision_msgs/msg/Detection2D": "std_msgs/Header header\n"
    "ObjectHypothesisWithPose[] results\nBoundingBox2D bbox\nstring id\n",
    "vision_msgs/msg/Detection2DArray": "std_msgs/Header header\n"
    "Detection2D[] detections\n",
    "bboxes_ex_msgs/msg/BoundingBox": "float32 probability\nuint16 xmin\nuint16 ymin\n"
    "uint16 xmax\nuint16 ymax\n"
    "uint16 id\nuint16 img_width\nuint16 img_height\nint32 center_dist\n"
    "string class_id\nuint16 class_id_int\n",
    "bboxes_ex_msgs/msg/BoundingBoxes": "std_msgs/Header header\n"
    "std_msgs/Header image_header\nBoundingBox[] bounding_boxes\n",
    "gb_visual_detection_3d_msgs/msg/BoundingBox3d": "string object_name\n"
    "float64 probability\nfloat64 xmin\nfloat64 ymin\nfloat64 xmax\nfloat64 ymax\n"
    "float64 zmin\nfloat64 zmax\n",
    "gb_visual_detection_3d_msgs/msg/BoundingBoxes3d": "std_msgs/Header header\n"
    "BoundingBox3d[] bounding_boxes\n",
    "yolo_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
    "yolo_msgs/msg/Vector2": "float64 x\nfloat64 y\n",
    "yolo_msgs/msg/Pose2D": "yolo_msgs/Point2D position\nfloat64 theta\n",
    "yolo_msgs/msg/BoundingBox2D": "yolo_msgs/Pose2D center\nyolo_msgs/Vector2 size\n",
    "yolo_msgs/msg/BoundingBox3D": "geometry_msgs/Pose center\n"
    "geometry_msgs/Vector3 size\nstring frame_id\n",
    "yolo_msgs/msg/Mask": "int32 height\nint32 width\nyolo_msgs/Point2D[] data\n",
    "yolo_msgs/msg/KeyPoint2D": "int32 id\nyolo_msgs/Point2D point\nfloat64 score\n",
    "yolo_msgs/msg/KeyPoint2DArray": "yolo_msgs/KeyPoint2D[] data\n",
    "yolo_msgs/msg/KeyPoint3D": "int32 id\ngeometry_msgs/Point point\nfloat64 score\n",
    "yolo_msgs/msg/KeyPoint3DArray": "yolo_msgs/KeyPoint3D[] data\nstring frame_id\n",
    "yolo_msgs/msg/Detection": "int32 class_id\nstring class_name\nfloat64 score\n"
    "string id\nyolo_msgs/BoundingBox2D bbox\nyolo_msgs/BoundingBox3D bbox3d\n"
    "yolo_msgs/Mask mask\nyolo_msgs/KeyPoint2DArray keypoints\n"
    "yolo_msgs/KeyPoint3DArray keypoints3d\n",
    "yolo_msgs/msg/DetectionArray": "std_msgs/Header header\n"
    "yolo_msgs/Detection[] detections\n",
}
STORE: Any = get_typestore(Stores.ROS2_JAZZY)
for _name, _text in _TEXTS.items():
    STORE.register(get_types_from_msg(_text, _name))

# --- classes ----------------------------------------------------------------------


class Message(ABC):
    """A ROS message: base of frozen dataclasses.

    Attributes:
        ROS: Its ROS name, such as ``nav_msgs/msg/Odometry``.
    """

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, Any]]
    ROS: ClassVar[str]


@dataclass(frozen=True, slots=True)
class Time(Message):
    """Seconds and nanoseconds since 1970."""

    ROS: ClassVar[str] = "builtin_interfaces/msg/Time"
    sec: int = 0
    nanosec: int = 0

    @classmethod
    def from_seconds(cls, seconds: float) -> "Time":
        """The stamp of a Unix time (s)."""
        whole = math.floor(seconds)
        return cls(whole, min(999_999_999, round((seconds - whole) * 1e9)))

    @property
    def seconds(self) -> float:
        """Unix time (s)."""
        return self.sec + self.nanosec / 1e9


_USUAL = {"geometry_msgs/msg/Quaternion": {"w": 1.0}}
"""Values of fields that are not zero unless given."""
STORE.types[Time.ROS] = Time


def message(ros: str) -> Any:
    """The class of a ROS message, made once."""
    made = STORE.types[ros]
    if not issubclass(made, Message):
        usual = _USUAL.get(ros, {})
        members = [
            (name, Any, usual.get(name, _zero(kind)))
            for name, kind in STORE.fielddefs[ros][1]
        ]
        made = STORE.types[ros] = make_dataclass(
            ros.rpartition("/")[2],
            members,
            bases=(Message,),
            namespace={"ROS": ros},
            frozen=True,
            slots=True,
        )
    return made


def _zero(kind: Any) -> Any:
    """Default of a field of this kind."""
    match kind:
        case (Nodetype.NAME, nested):
            return field(default_factory=message(nested))
        case (Nodetype.ARRAY, ((Nodetype.BASE, (base, _)), count)):
            return field(default_factory=partial(np.zeros, count, base))
        case (Nodetype.SEQUENCE, ((Nodetype.BASE, (base, _)), _)) if base != "string":
            return field(default_factory=partial(np.zeros, 0, base))
        case (Nodetype.SEQUENCE, (inner, _)):
            _zero(inner)  # its class is made, too
            return ()
        case (_, (base, _)):
            return "" if base == "string" else np.dtype(base).type().item()


# --- messages ---------------------------------------------------------------------

_PACKAGES = (
    *("std_msgs", "geometry_msgs", "nav_msgs", "sensor_msgs", "tf2_msgs"),
    *("builtin_interfaces", "visualization_msgs", "vision_msgs"),
)
PicturePose: Any = message("vision_msgs/msg/Pose2D")


def short_named(name: str, packages: Iterable[str]) -> Any:
    """The class of a message in one of these packages.

    Raises:
        AttributeError: no such message.
    """
    for package in packages:
        if (ros := f"{package}/msg/{name}") in STORE.fielddefs:
            return message(ros)
    raise AttributeError(f"no message {name} in {', '.join(packages)}")


def __getattr__(name: str) -> Any:
    """The class of a message by its short name, made at its first use."""
    made = globals()[name] = short_named(name, _PACKAGES)
    return made
