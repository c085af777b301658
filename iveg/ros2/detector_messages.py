"""Messages of detectors beside ``vision_msgs``, and definitions that rosbags lacks."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from iveg.ros2.messages import Header, LeftOut, Message, Pose, Stamped, Vector3

# --- definitions ------------------------------------------------------------------
#
# Definitions of messages of detectors, which rosbags lacks; sources: their packages.
#
# ``vision_msgs`` 4, ``bboxes_ex_msgs`` (Ar-Ray-code, the messages of YOLOX-ROS),
# ``gb_visual_detection_3d_msgs`` (IntelligentRoboticsLabs, master of 2020, ROS 2) and
# ``yolo_msgs`` (mgonzs13/yolo_ros, 2026); forks with other fields have another type
# hash.

_BOX = "bboxes_ex_msgs/msg/BoundingBox"
_OLDER = {
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
    _BOX: "float32 probability\nuint16 xmin\nuint16 ymin\nuint16 xmax\nuint16 ymax\n"
    "uint16 id\nuint16 img_width\nuint16 img_height\nint32 center_dist\n"
    "string class_id\n",
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
NUMBERED = "NumberedBoundingBox"
"""Class of the box of ``bboxes_ex_msgs`` as since July 2022."""
TEXTS = _OLDER, _OLDER | {_BOX: _OLDER[_BOX] + "uint16 class_id_int\n"}
"""ROS name → definition: before, and since July 2022."""


# --- detector messages ------------------------------------------------------------
#
# Messages of detectors beside ``vision_msgs``, field for field as ``definitions``.

# --- bboxes_ex_msgs ----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BoundingBox(Message, package="bboxes_ex_msgs"):
    """A box between two corners (pixels); ``probability`` 0 to 1.

    ``img_width`` and ``img_height`` are zero where the detector leaves them out.
    """

    probability: float = 0.0
    xmin: int = 0
    ymin: int = 0
    xmax: int = 0
    ymax: int = 0
    id: int = 0
    img_width: int = 0
    img_height: int = 0
    center_dist: int = 0
    class_id: str = ""


@dataclass(frozen=True, slots=True)
class NumberedBoundingBox(BoundingBox):
    """A box as since July 2022."""

    class_id_int: int = 0


@dataclass(frozen=True, slots=True)
class NumberedBoundingBoxes(Stamped):
    """Boxes of one picture as since July 2022."""

    ROS: ClassVar[str] = "bboxes_ex_msgs/msg/BoundingBoxes"
    image_header: Header = field(default_factory=Header)
    bounding_boxes: Sequence[NumberedBoundingBox] = ()


@dataclass(frozen=True, slots=True)
class BoundingBoxes(Stamped, package="bboxes_ex_msgs"):
    """Boxes of one picture; YOLOX-ROS puts the picture's header into ``header``."""

    NEWER: ClassVar[type[Message] | None] = NumberedBoundingBoxes

    image_header: Header = field(default_factory=Header)
    bounding_boxes: Sequence[BoundingBox] = ()


# --- gb_visual_detection_3d_msgs ---------------------------------------------------


@dataclass(frozen=True, slots=True)
class BoundingBox3d(Message, package="gb_visual_detection_3d_msgs"):
    """A box along the axes of the header's frame (m); ``probability`` 0 to 1."""

    object_name: str = ""
    probability: float = 0.0
    xmin: float = 0.0
    ymin: float = 0.0
    xmax: float = 0.0
    ymax: float = 0.0
    zmin: float = 0.0
    zmax: float = 0.0


@dataclass(frozen=True, slots=True)
class BoundingBoxes3d(Stamped, package="gb_visual_detection_3d_msgs"):
    """Boxes of one picture, with depth."""

    bounding_boxes: Sequence[BoundingBox3d] = ()


# --- yolo_msgs ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Point2D(Message, package="yolo_msgs"):
    """(pixels)."""

    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class Vector2(Message, package="yolo_msgs"):
    """(pixels)."""

    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class Pose2D(Message, package="yolo_msgs"):
    """Pixels and a turn (rad)."""

    position: Point2D = Point2D()
    theta: float = 0.0


@dataclass(frozen=True, slots=True)
class BoundingBox2D(Message, package="yolo_msgs"):
    """A box about its centre (pixels)."""

    center: Pose2D = Pose2D()
    size: Vector2 = Vector2()


@dataclass(frozen=True, slots=True)
class BoundingBox3D(Message, package="yolo_msgs"):
    """A box about its centre (m); without a frame there is none."""

    center: Pose = field(default_factory=Pose)
    size: Vector3 = field(default_factory=Vector3)
    frame_id: str = ""


@dataclass(frozen=True, slots=True)
class Detection(Message, package="yolo_msgs"):
    """One detected object; ``score`` 0 to 1."""

    class_id: int = 0
    class_name: str = ""
    score: float = 0.0
    id: str = ""
    bbox: BoundingBox2D = BoundingBox2D()
    bbox3d: BoundingBox3D = BoundingBox3D()
    mask: Any = LeftOut
    keypoints: Any = LeftOut
    keypoints3d: Any = LeftOut


@dataclass(frozen=True, slots=True)
class DetectionArray(Stamped, package="yolo_msgs"):
    """Detections of one picture, with depth where a node has added it."""

    detections: Sequence[Detection] = ()
