"""Topics of a ROS 2 robot, its small sensors, and the families of its detectors."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from iveg.domain.kinds import Kind, row_of
from iveg.domain.observations import UNKNOWN_ORIGIN, Battery, Observation
from iveg.ros2 import detector_messages as d
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message
from iveg.ros2.names import DEFAULT, LATCHED, SENSOR_DATA, TF, TF_STATIC, Qos

# --- sensors ----------------------------------------------------------------------
#
# Small sensors on a ROS 2 robot: topic and type of each, one row a sensor.


def read_battery(state: ros.BatteryState) -> Battery:
    """Read the state of the battery.

    ROS writes NaN for unmeasured values, and some drivers per cent instead of a share.
    """
    share: float | None = state.percentage
    if share is None or not math.isfinite(share) or not 0.0 <= share <= 100.0:
        share = None
    elif share > 1.0:
        share /= 100.0
    volts = state.voltage if math.isfinite(state.voltage) else None
    status = {1: True, 2: False, 3: False, 4: False}.get(state.power_supply_status)
    return Battery("", UNKNOWN_ORIGIN, share, status, volts)


def write_battery(header: ros.Header, battery: Any) -> ros.BatteryState:
    """The inverse, for an emulated base."""
    return ros.BatteryState(
        header, voltage=battery.voltage, percentage=battery.percentage
    )


@dataclass(frozen=True, slots=True)
class RosSensor:
    """One row.

    Attributes:
        observation: Its class; the key in ``robot.toml`` is the kind's name.
        topic: Its name by default.
        read: Message → observation.  Raises UnreadableError.
        write: Header and observation → message.
    """

    observation: type[Observation]
    topic: str
    message: type[Message]
    read: Callable[[Any], Observation]
    write: Callable[[ros.Header, Any], Message]

    @property
    def kind(self) -> Kind:
        """Its row among the observations."""
        return row_of(self.observation)

    @property
    def every_s(self) -> float:
        """Least time between two readings that are sent to iVeg (s)."""
        return self.kind.sensor.every_s if self.kind.sensor else 0.0


ROS_SENSORS = {
    row.kind.name: row
    for row in (
        RosSensor(
            Battery,
            "battery_state",
            ros.BatteryState,
            read_battery,
            write_battery,
        ),
    )
}
"""Rows by name.  A small sensor that is missing here has no ROS 2 form."""


# --- detectors --------------------------------------------------------------------
#
# Detections of each family of messages, as those of ``vision_msgs``.
#
# YOLOX-ROS writes a box over the left or upper edge of its picture as negative numbers
# into 16 bits without a sign.

_SIGN, _WRAP = 1 << 15, 1 << 16


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """Detections of one picture, without depth.

    Attributes:
        header: Of the picture.
        width: Of the picture (pixels), ``height`` likewise; 0: unknown.
    """

    header: ros.Header
    detections: tuple[ros.Detection2D, ...]
    width: int = 0
    height: int = 0


def _yolox(look: d.BoundingBoxes) -> Look:
    boxes, own = look.bounding_boxes, look.image_header
    header = own if own.frame_id or own.stamp != ros.Time() else look.header
    width = max((box.img_width for box in boxes), default=0)
    height = max((box.img_height for box in boxes), default=0)
    return Look(header, tuple(map(_yolox_box, boxes)), width, height)


def _yolox_box(yolox: d.BoundingBox) -> ros.Detection2D:
    xmin, ymin, xmax, ymax = (
        float(edge - _WRAP if edge >= _SIGN else edge)
        for edge in (yolox.xmin, yolox.ymin, yolox.xmax, yolox.ymax)
    )
    centre = ros.Point2D((xmin + xmax) / 2, (ymin + ymax) / 2)
    box = ros.BoundingBox2D(ros.PicturePose(centre), xmax - xmin, ymax - ymin)
    return ros.Detection2D(ros.Header(), _sure(yolox.class_id, yolox.probability), box)


def _yolo_box(yolo: d.Detection) -> ros.Detection2D:
    centre, size = yolo.bbox.center, yolo.bbox.size
    place = ros.PicturePose(
        ros.Point2D(centre.position.x, centre.position.y), centre.theta
    )
    box = ros.BoundingBox2D(place, size.x, size.y)
    return ros.Detection2D(ros.Header(), _yolo_class(yolo), box, yolo.id)


def _yolo_box_3d(yolo: d.Detection) -> ros.Detection3D:
    box = yolo.bbox3d
    # Without a frame no node has added depth: the zeros in the box are no place.
    centre = box.center if box.frame_id else ros.Pose(ros.Point(math.nan))
    header = ros.Header(frame_id=box.frame_id)
    bounds = ros.BoundingBox3D(centre, box.size)
    return ros.Detection3D(header, _yolo_class(yolo), bounds, yolo.id)


def _yolo_class(yolo: d.Detection) -> tuple[ros.ObjectHypothesisWithPose, ...]:
    return _sure(yolo.class_name or str(yolo.class_id), yolo.score)


def _yolact_box(hull: d.BoundingBox3d) -> ros.Detection3D:
    centre = ros.Point(
        (hull.xmin + hull.xmax) / 2,
        (hull.ymin + hull.ymax) / 2,
        (hull.zmin + hull.zmax) / 2,
    )
    size = ros.Vector3(
        hull.xmax - hull.xmin, hull.ymax - hull.ymin, hull.zmax - hull.zmin
    )
    box = ros.BoundingBox3D(ros.Pose(centre), size)
    return ros.Detection3D(ros.Header(), _sure(hull.object_name, hull.probability), box)


def _sure(class_id: str, score: float) -> tuple[ros.ObjectHypothesisWithPose, ...]:
    return (ros.ObjectHypothesisWithPose(ros.ObjectHypothesis(class_id, score)),)


LOOKS: Mapping[type[Message], Callable[[Any], Look]] = {
    ros.Detection2DArray: lambda look: Look(look.header, tuple(look.detections)),
    d.BoundingBoxes: _yolox,
    d.DetectionArray: lambda look: Look(
        look.header, tuple(map(_yolo_box, look.detections))
    ),
}
"""Boxes in a picture, by type; they need its depth."""

BOXES: Mapping[type[Message], Callable[[Any], ros.Detection3DArray]] = {
    ros.Detection3DArray: lambda boxes: boxes,
    d.BoundingBoxes3d: lambda boxes: ros.Detection3DArray(
        boxes.header, tuple(map(_yolact_box, boxes.bounding_boxes))
    ),
    d.DetectionArray: lambda boxes: ros.Detection3DArray(
        boxes.header, tuple(map(_yolo_box_3d, boxes.detections))
    ),
}
"""Boxes with a place, by type."""


# --- topics -----------------------------------------------------------------------
#
# Topics of a ROS 2 robot: one row each, in the order in which they are read.

Role = Literal["stream", "state", "picture", "transforms", "drive", "output"]
"""``stream``: old messages do not count; ``state``: the newest counts; ``picture``: few
may be pending; ``transforms``: every message counts; ``drive``: on either side of the
gate, stamped or not; ``output``: for goals, neighbours and the costmap."""


@dataclass(frozen=True, slots=True)
class RosTopic:
    """One row.

    Attributes:
        name: As in ROS nodes, by default: relative ones are below the namespace;
            empty: none.
        message: Its type.
        qos: A best-effort reader matches every writer; only commands are read reliably.
        forms: All types that are read; a detector publishes one of several.
    """

    name: str
    message: type[Message]
    role: Role = "state"
    qos: Qos = SENSOR_DATA
    forms: tuple[type[Message], ...] = ()

    def __post_init__(self) -> None:
        if not self.forms:
            object.__setattr__(self, "forms", (self.message,))

    def form(self, ros_type: str) -> type[Message] | None:
        """The type of this ROS name; None for one that is not read."""
        return next((form for form in self.forms if ros_type == form.ROS), None)


TOPICS: Mapping[str, RosTopic] = {
    "odometry": RosTopic("odom", ros.Odometry, "stream"),
    "scan": RosTopic("scan", ros.LaserScan, "stream"),
    "detections_3d": RosTopic(
        "detections_3d", ros.Detection3DArray, "stream", forms=tuple(BOXES)
    ),
    # With depth and camera_info an alternative to detections_3d.
    "detections_2d": RosTopic("", ros.Detection2DArray, "stream", forms=tuple(LOOKS)),
    "depth": RosTopic("camera/aligned_depth_to_color/image_raw", ros.Image, "picture"),
    "camera_info": RosTopic("camera/color/camera_info", ros.CameraInfo),
    # In a mono picture value n marks the n-th detection; without, the whole box counts.
    "mask": RosTopic("", ros.Image, "picture"),
    **{
        name: RosTopic(sensor.topic, sensor.message)
        for name, sensor in ROS_SENSORS.items()
    },
    "path": RosTopic("plan", ros.Path),
    # After a pause each datum finds the transform that was published before it, though
    # both arrive while the topics are being read.
    "tf_static": RosTopic("tf_static", ros.TFMessage, "transforms", TF_STATIC),
    "tf": RosTopic("tf", ros.TFMessage, "transforms", TF),
    "cmd_vel_in": RosTopic("cmd_vel_nav", ros.Twist, "drive"),
    "cmd_vel_out": RosTopic("cmd_vel", ros.Twist, "drive", DEFAULT),
    # Goals of iVeg, as Nav2 takes them.
    "goal": RosTopic("goal_pose", ros.PoseStamped, "output", DEFAULT),
    # People and peers, for Nav2's obstacle layer and for RViz.
    "obstacles": RosTopic("iveg/obstacles", ros.PointCloud2, "output", DEFAULT),
    "markers": RosTopic("iveg/markers", ros.MarkerArray, "output", DEFAULT),
    # The fleet's picture, for Nav2's static layer.
    "costmap": RosTopic("iveg/costmap", ros.OccupancyGrid, "output", LATCHED),
}
"""Rows by key in ``robot.toml``."""

_CAMERA = frozenset({"depth", "camera_info", "mask"})


def sensed_topics(names: Mapping[str, str]) -> dict[str, str]:
    """Topics that a robot's sensors publish on: key → full name.

    A camera is read only where detections have no depth.
    """
    unread = frozenset() if names["detections_2d"] else _CAMERA
    return {
        key: names[key]
        for key, topic in TOPICS.items()
        if topic.role not in ("drive", "output") and names[key] and key not in unread
    }
