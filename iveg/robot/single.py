"""Algorithm 1's single payload, as the paper writes it: one message per robot and tick.

The payload has room for one detection, so those of one frame take turns, the most
probable first; a scan is sent once; an empty frame, which the paper cannot express, is
an empty ``bounding_boxes`` beside it.  ``pose`` and ``lidar_header`` carry the origin.
"""

import orjson

from iveg.domain.geometry import Pose2D
from iveg.domain.observations import (
    Detection,
    DetectionFrame,
    LaserScan,
    Odometry,
)
from iveg.ngsi import names
from iveg.ngsi.codec.fields import (
    write_lidar_header,
    write_motion,
    write_origin,
)
from iveg.ngsi.codec.reports import write_unread


class SinglePayload:
    """Collects observations until odometry triggers a message.

    Args:
        robot_id: This robot.
    """

    def __init__(self, robot_id: str) -> None:
        self._id = robot_id
        self.scan: LaserScan | None = None
        """The sweep that has not been sent yet."""
        self._detections: list[Detection] = []
        self._saw_nothing = False
        self._unread: tuple[str | None, ...] = ()

    def replace_frame(self, frame: DetectionFrame) -> None:
        """Note a detection frame; it replaces what is left of the one before."""
        self._detections = sorted(frame.detections, key=lambda one: one.probability)
        self._saw_nothing = not frame.detections and not frame.unread
        self._unread = frame.unread

    def write(self, odometry: Odometry) -> bytes:
        """Payload of ``/{apikey}/{robot}/attrs`` for this odometry tick."""
        origin = write_origin(odometry.origin)
        payload: dict[str, object] = {
            "pose": {**write_motion(odometry.pose, odometry.twist), **origin},
            "timestamp": odometry.origin.stamp,
            "TimeInstant": odometry.origin.stamp,
        }
        if self._detections:
            payload |= _detected(self._detections.pop(), odometry.pose)
        elif self._unread:
            nowhere, self._unread = write_unread(self._unread), ()
            payload |= {names.BOXES: nowhere, names.BOXES_HEADER: origin}
        elif self._saw_nothing:
            self._saw_nothing = False
            payload |= {names.BOXES: [], names.BOXES_HEADER: origin}
        if self.scan is not None:
            payload["laser_scan"] = self.scan.ranges
            payload[names.LIDAR_HEADER] = write_lidar_header(self.scan, origin)
            self.scan = None
        return orjson.dumps(payload, option=orjson.OPT_SERIALIZE_NUMPY)


def _detected(detection: Detection, pose: Pose2D) -> dict[str, object]:
    x, y, z = detection.box.centre
    if detection.frame_id != "map":
        x, y = pose.transform(x, y)
    return {
        "class": detection.class_id,
        "conf": round(detection.probability, 4),
        "position_3D": {"x": round(x, 4), "y": round(y, 4), "z": round(z, 4)},
    }
