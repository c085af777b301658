"""Messages of detectors beside ``vision_msgs``, field for field as each defines them.

Sources: ``bboxes_ex_msgs`` (Ar-Ray-code, the messages of YOLOX-ROS),
``gb_visual_detection_3d_msgs`` (IntelligentRoboticsLabs, master of 2020, ROS 2) and
``yolo_msgs`` (mgonzs13/yolo_ros, 2026); forks with other fields have another type hash.
"""

from dataclasses import dataclass, field

from iveg.ros2.geometry_msgs import Point, Pose, Vector3
from iveg.ros2.schema import Float32, Float64, Int32, Message, Uint16
from iveg.ros2.std_msgs import Header, Stamped

# --- bboxes_ex_msgs ----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class BoundingBox(Message, package="bboxes_ex_msgs"):
    """A box between two corners (pixels); ``probability`` 0 to 1.

    ``img_width`` and ``img_height`` are zero where the detector leaves them out.
    """

    probability: Float32 = 0.0
    xmin: Uint16 = 0
    ymin: Uint16 = 0
    xmax: Uint16 = 0
    ymax: Uint16 = 0
    id: Uint16 = 0
    img_width: Uint16 = 0
    img_height: Uint16 = 0
    center_dist: Int32 = 0
    class_id: str = ""


@dataclass(frozen=True, slots=True)
class BoundingBoxes(Stamped, package="bboxes_ex_msgs"):
    """Boxes of one picture; YOLOX-ROS puts the picture's header into ``header``."""

    image_header: Header = field(default_factory=Header)
    bounding_boxes: tuple[BoundingBox, ...] = ()


# --- gb_visual_detection_3d_msgs ---------------------------------------------------


@dataclass(frozen=True, slots=True)
class BoundingBox3d(Message, package="gb_visual_detection_3d_msgs"):
    """A box along the axes of the header's frame (m); ``probability`` 0 to 1."""

    object_name: str = ""
    probability: Float64 = 0.0
    xmin: Float64 = 0.0
    ymin: Float64 = 0.0
    xmax: Float64 = 0.0
    ymax: Float64 = 0.0
    zmin: Float64 = 0.0
    zmax: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class BoundingBoxes3d(Stamped, package="gb_visual_detection_3d_msgs"):
    """Boxes of one picture, with depth."""

    bounding_boxes: tuple[BoundingBox3d, ...] = ()


# --- yolo_msgs ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Point2D(Message, package="yolo_msgs"):
    """(pixels)."""

    x: Float64 = 0.0
    y: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class Vector2(Message, package="yolo_msgs"):
    """(pixels)."""

    x: Float64 = 0.0
    y: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class Pose2D(Message, package="yolo_msgs"):
    """Pixels and a turn (rad)."""

    position: Point2D = Point2D()
    theta: Float64 = 0.0


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
class Mask(Message, package="yolo_msgs"):
    """Outline of what was segmented; not used."""

    height: Int32 = 0
    width: Int32 = 0
    data: tuple[Point2D, ...] = ()


@dataclass(frozen=True, slots=True)
class KeyPoint2D(Message, package="yolo_msgs"):
    """A joint of a body in the picture; not used."""

    id: Int32 = 0
    point: Point2D = Point2D()
    score: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class KeyPoint2DArray(Message, package="yolo_msgs"):
    """Joints of a body in the picture; not used."""

    data: tuple[KeyPoint2D, ...] = ()


@dataclass(frozen=True, slots=True)
class KeyPoint3D(Message, package="yolo_msgs"):
    """A joint of a body; not used."""

    id: Int32 = 0
    point: Point = field(default_factory=Point)
    score: Float64 = 0.0


@dataclass(frozen=True, slots=True)
class KeyPoint3DArray(Message, package="yolo_msgs"):
    """Joints of a body; not used."""

    data: tuple[KeyPoint3D, ...] = ()
    frame_id: str = ""


@dataclass(frozen=True, slots=True)
class Detection(Message, package="yolo_msgs"):
    """One detected object; ``score`` 0 to 1."""

    class_id: Int32 = 0
    class_name: str = ""
    score: Float64 = 0.0
    id: str = ""
    bbox: BoundingBox2D = BoundingBox2D()
    bbox3d: BoundingBox3D = BoundingBox3D()
    mask: Mask = Mask()
    keypoints: KeyPoint2DArray = KeyPoint2DArray()
    keypoints3d: KeyPoint3DArray = KeyPoint3DArray()


@dataclass(frozen=True, slots=True)
class DetectionArray(Stamped, package="yolo_msgs"):
    """Detections of one picture, with depth where a node has added it."""

    detections: tuple[Detection, ...] = ()
