"""Places in ``map`` of a robot, its sensors and the boxes of its detectors."""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Box3D
from iveg.domain.observations import UNKNOWN_ORIGIN, Detection, DetectionFrame, Instant
from iveg.robot.grounding import (
    EDGE_LIMIT,
    DepthPicture,
    Grounding,
    Pinhole,
    Segment,
    Ungrounded,
    corners_of,
    frame_of,
    ground,
    hull_of,
    top_left,
)
from iveg.robot.ros2 import reading
from iveg.robot.ros2.config import Frames
from iveg.robot.ros2.reading import (
    InputFaults,
    class_id_of,
    read_hypothesis,
    read_pose,
    within_world,
)
from iveg.robot.ros2.topics import BOXES, LOOKS, Look
from iveg.robot.ros2.transforms import NoTransformError, RigidTransform, TransformBuffer
from iveg.ros2 import messages as ros
from iveg.ros2.messages import Message

# --- places -----------------------------------------------------------------------
#
# Places in ``map`` of a robot, its sensors and detections with depth; a missing
# transform is a fault.

_AGREES_M = 0.5
"""Way that a robot drives while its newest transform grows old (m)."""


@dataclass(frozen=True, slots=True, eq=False)
class Here:
    """Pose of the robot in ``map`` and in its odometry frame, at a stamp (s)."""

    in_map: RigidTransform
    in_odom: RigidTransform
    odom: str
    stamp: float


class Places:
    """Newest pose of a robot, and its transforms; ``now`` is monotonic seconds.

    Args:
        frames: Their names.
        max_age_s: Greatest age of a transform (s).
        input_faults: Record of faults.

    Attributes:
        here: None while the robot is not localised.
    """

    def __init__(
        self, frames: Frames, max_age_s: float, input_faults: InputFaults
    ) -> None:
        self._frames, self._max_age_s = frames, max_age_s
        self._input_faults = input_faults
        self._transforms = TransformBuffer(max_age_s)
        self.here: Here | None = None

    def add(self, message: ros.TFMessage, *, static: bool) -> None:
        """Store a message of ``/tf`` or ``/tf_static``."""
        self._transforms.add(message, static=static)

    def forget(self) -> None:
        """Delete stamped values, since the clock was set back."""
        self._transforms.clear()
        self.here = None

    def locate(self, odometry: ros.Odometry, now: float) -> RigidTransform | None:
        """Pose of the robot in ``map``; None where a transform is missing.

        Raises:
            UnreadableError: the pose is invalid.
        """
        stamp = odometry.header.stamp.seconds
        odom = odometry.header.frame_id.lstrip("/") or self._frames.odom
        in_odom = self._base_in_odom(odometry, stamp, now)
        to_map = self.in_map(odom, stamp, now)
        if in_odom is None or to_map is None:
            self.here = None
            return None
        place = to_map.compose(in_odom)
        self._compare(place, stamp, now)
        self.here = Here(place, in_odom, odom, stamp)
        return place

    def _compare(self, place: RigidTransform, stamp: float, now: float) -> None:
        """Note a fault where TF places the robot elsewhere than its odometry."""
        frames = self._frames
        with suppress(NoTransformError):
            tree = self._transforms.lookup(frames.map, frames.base_link, stamp)
            if math.dist(tree.move[:2], place.move[:2]) > _AGREES_M:
                link = f"{frames.map} → {frames.base_link}"
                self._input_faults.note("pose_disagrees", link, now)

    def _base_in_odom(
        self, odometry: ros.Odometry, stamp: float, now: float
    ) -> RigidTransform | None:
        pose = read_pose(odometry)
        child = odometry.child_frame_id.lstrip("/")
        if child in ("", self._frames.base_link):
            return pose
        base = self._lookup(child, self._frames.base_link, stamp, now)
        return None if base is None else pose.compose(base)

    def laser(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of the laser relative to the robot's pose; None where one is missing."""
        here = self.here
        # With a pose of another moment a sweep would lie beside the walls that it saw.
        if here is None or abs(stamp - here.stamp) > self._max_age_s:
            self.on_robot(frame, stamp, now)  # a missing mount is a fault all the same
            return None
        # Odometry may be missing in the tree; the mount must be there.
        with suppress(NoTransformError):
            in_odom = self._transforms.lookup(here.odom, frame.lstrip("/"), stamp)
            return here.in_odom.inverse().compose(in_odom)
        return self.on_robot(frame, stamp, now)

    def on_robot(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of a frame in ``base_link``; None where one is missing."""
        return self._lookup(self._frames.base_link, frame, stamp, now)

    def in_map(self, frame: str, stamp: float, now: float) -> RigidTransform | None:
        """Pose of a frame in ``map``; None for a missing one."""
        return self._lookup(self._frames.map, frame, stamp, now)

    def detections(self, message: Message, topic: str, now: float) -> DetectionFrame:
        """The detection frame of a message of one of ``BOXES``.

        Each box is placed by the frame of its header, or of the message's; ``topic`` is
        the full name, for faults.
        """
        boxes = BOXES[type(message)](message)
        usual, stamp = boxes.header.frame_id, boxes.header.stamp.seconds
        frames = dict.fromkeys(box.header.frame_id or usual for box in boxes.detections)
        places = {frame: self.in_map(frame, stamp, now) for frame in frames}
        answers = [
            self._detection(box, places[box.header.frame_id or usual], topic, now)
            for box in boxes.detections
        ]
        return frame_of(answers)

    def _detection(
        self, box: ros.Detection3D, place: RigidTransform | None, topic: str, now: float
    ) -> tuple[str | None, Detection | Ungrounded]:
        """Class of a detection, and the detection or the reason why it has no place."""
        if place is not None:
            try:
                detection = reading.read_detection(box, place)
            except UnreadableError as error:
                self._input_faults.note(error.reason, topic, now)
            else:
                return detection.class_id, detection
        return reading.class_id_of(box.results), "unreadable"

    def _lookup(
        self, outer: str, inner: str, stamp: float, now: float
    ) -> RigidTransform | None:
        try:
            return self._transforms.lookup(outer, inner.lstrip("/"), stamp)
        except NoTransformError as error:
            self._input_faults.note("no_transform", error.link, now, error.for_s)
            return None


# --- pictures ---------------------------------------------------------------------
#
# Detections without depth: boxes in a picture, located by a depth picture.
#
# The paper's grounding (``iveg.robot.grounding``) on the boxes of a picture, a depth
# ``Image`` registered to the detector's camera, and its ``CameraInfo``.  In a mask
# picture value n marks the n-th detection, counted from 1, and 255 marks any.
# Without a mask the target is the part of the box at about the depth of its middle: the
# whole box would include the wall behind a person.

_SQUARE = 0.02
_ANY = 255
_THICK_M = 0.5
_DEPTHS: dict[str, tuple[str, float]] = {
    "16UC1": ("u2", 0.001),
    "mono16": ("u2", 0.001),
    "32FC1": ("f4", 1.0),
}
"""Encoding → number type, and its unit (m)."""
_MASKS = {"mono8": "u1", "8UC1": "u1", "mono16": "u2", "16UC1": "u2"}


def nearest(pictures: Iterable[ros.Image], stamp: float) -> ros.Image | None:
    """The picture of a stamp; None: there is none of that moment."""

    def off_s(picture: ros.Image) -> float:
        return abs(float(picture.header.stamp.seconds - stamp))

    same = (picture for picture in pictures if off_s(picture) <= _SAME_PICTURE_S)
    return min(same, key=off_s, default=None)


def read_camera(info: ros.CameraInfo) -> Pinhole:
    """A rectified camera.

    Raises:
        UnreadableError: ``bad_camera``: no focal length, or pixels that are not square.
    """
    fx, fy, cx, cy = info.p[[0, 5, 2, 6]].tolist()
    if fx == 0.0:  # drivers of rectified cameras may omit p
        fx, fy, cx, cy = info.k[[0, 4, 2, 5]].tolist()
    usable = all(map(np.isfinite, (fx, fy, cx, cy))) and fx > 0.0
    if not usable or abs(fx - fy) > _SQUARE * fx:
        raise UnreadableError("bad_camera", f"focal lengths {fx:g} and {fy:g}")
    return Pinhole(info.width, info.height, fx, cx, cy)


def read_depth(image: ros.Image, info: ros.CameraInfo) -> DepthPicture:
    """The depth of each pixel (m).

    Raises:
        UnreadableError: ``bad_camera``, ``bad_encoding``, ``bad_picture``, or depth of
            another shape than the camera (``bad_depth_shape``).
    """
    known = _DEPTHS.get(image.encoding)
    if known is None:
        raise UnreadableError("bad_encoding", image.encoding)
    kind, unit = known
    depth = _pixels(image, kind).astype(np.float32) * np.float32(unit)
    return DepthPicture(read_camera(info), depth)


def _pixels(image: ros.Image, kind: str) -> NDArray[np.generic]:
    dtype = np.dtype((">" if image.is_bigendian else "<") + kind)
    width, height, step = image.width, image.height, image.step
    fits = 0 < width <= EDGE_LIMIT and 0 < height <= EDGE_LIMIT
    if not fits or step < width * dtype.itemsize or image.data.size < step * height:
        raise UnreadableError("bad_picture", f"{width} × {height}, {image.data.size}")
    rows = image.data[: step * height].reshape(height, step)
    return np.ascontiguousarray(rows[:, : width * dtype.itemsize]).view(dtype)


def grounded(
    look: Look,
    picture: DepthPicture,
    mask: ros.Image | None,
    place: RigidTransform,
    settings: Grounding,
) -> DetectionFrame:
    """One detection frame with its boxes in ``map``.

    Args:
        look: Detections of the picture.
        picture: Depth at that moment.
        mask: Detection of each pixel; None: the whole box.
        place: Pose of the camera's optical frame in ``map``.
        settings: Parameters that the paper leaves open.

    Raises:
        UnreadableError: ``bad_picture``: boxes or mask are of another size.
    """
    camera = picture.camera
    if look.width and (look.width, look.height) != (camera.width, camera.height):
        detail = f"boxes in {look.width} × {look.height}"
        raise UnreadableError("bad_picture", detail)
    owners = None if mask is None else _pixels(mask, _MASKS.get(mask.encoding, "u1"))
    if owners is not None and owners.shape != picture.depth.shape:
        raise UnreadableError("bad_picture", f"a mask of {owners.shape}")
    answers = [
        (
            class_id_of(box.results),
            _place(number, box, picture, owners, place, settings),
        )
        for number, box in enumerate(look.detections, 1)
    ]
    return frame_of(answers)


def _place(
    number: int,
    box: ros.Detection2D,
    picture: DepthPicture,
    owners: NDArray[np.generic] | None,
    place: RigidTransform,
    settings: Grounding,
) -> Detection | Ungrounded:
    try:
        segment = _segment(number, box, picture, owners)
        answer = ground(segment, picture, settings)
    except UnreadableError:
        return "unreadable"
    if not isinstance(answer, Box3D):
        return answer
    hull = within_world(hull_of(place.apply(corners_of(answer))))
    return Detection(segment.class_id, segment.probability, hull, "map")


def _segment(
    number: int,
    box: ros.Detection2D,
    picture: DepthPicture,
    owners: NDArray[np.generic] | None,
) -> Segment:
    class_id, probability = read_hypothesis(box.results)
    centre, bounds = box.bbox.center.position, box.bbox
    numbers = centre.x, centre.y, bounds.size_x, bounds.size_y
    if not all(map(np.isfinite, numbers)) or max(map(abs, numbers)) > EDGE_LIMIT:
        raise UnreadableError("bad_box", "a box that is none")
    width, height = max(1, round(bounds.size_x)), max(1, round(bounds.size_y))
    left, top = top_left(centre.x, centre.y, width, height)
    rows, columns = picture.depth.shape
    # Detectors draw boxes over the edges of a picture.
    x0, x1 = np.clip((left, left + width), 0, columns).tolist()
    y0, y1 = np.clip((top, top + height), 0, rows).tolist()
    cut = slice(y0, y1), slice(x0, x1)
    if owners is None:
        own = _as_far_as_the_middle(picture.depth[cut])
    else:
        own = np.isin(owners[cut], (number, _ANY))
    return Segment(class_id, probability, (x0 + x1) / 2, (y0 + y1) / 2, own)


def _as_far_as_the_middle(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels within half a metre of the depth at the middle of a box."""
    height, width = depth.shape
    middle = depth[height // 4 : -(-3 * height // 4), width // 4 : -(-3 * width // 4)]
    measured = middle[np.isfinite(middle) & (middle > 0.0)]
    if not measured.size:
        return np.zeros(depth.shape, np.bool_)
    near: NDArray[np.bool_] = np.abs(depth - np.median(measured)) <= _THICK_M
    return near & (depth > 0.0)


# --- camera -----------------------------------------------------------------------
#
# A robot's camera: detections in a picture wait for the depth of that picture.

_PICTURES = 6
_SAME_PICTURE_S = 0.05
_DEPTH_LATE_S = 0.3


class Camera:
    """The newest detection frame without depth, and the pictures that locate it.

    Args:
        names: Full names of topics, for faults.
        settings: Parameters that the paper leaves open.
        places: Transforms of the robot.
        input_faults: Record of faults.
    """

    def __init__(
        self,
        names: Mapping[str, str],
        settings: Grounding,
        places: Places,
        input_faults: InputFaults,
    ) -> None:
        self._names, self._settings = names, settings
        self._places, self._input_faults = places, input_faults
        self._depths: deque[ros.Image] = deque(maxlen=_PICTURES)
        self._masks: deque[ros.Image] = deque(maxlen=_PICTURES)
        self._info: ros.CameraInfo | None = None
        self._look: tuple[Look, float] | None = None

    def add_depth(self, picture: ros.Image, _: Instant) -> None:
        """Keep a depth picture."""
        self._depths.append(picture)

    def add_mask(self, picture: ros.Image, _: Instant) -> None:
        """Keep a mask picture."""
        self._masks.append(picture)

    def set_info(self, info: ros.CameraInfo, _: Instant) -> None:
        """Note the calibration."""
        self._info = info

    def replace_look(self, look: Message, now: Instant) -> None:
        """Note a detection frame of one of ``LOOKS``; one that waits is replaced."""
        self._look = LOOKS[type(look)](look), now.mono

    def locate(self, now: float) -> tuple[DetectionFrame, float] | None:
        """The detection frame once its depth picture arrived, or is overdue.

        Beside it the stamp of its picture (s).
        """
        if self._look is None:
            return None
        look, since = self._look
        stamp = look.header.stamp.seconds
        depth = nearest(self._depths, stamp)
        incomplete = depth is None or self._info is None
        if incomplete and now - since < _DEPTH_LATE_S:
            return None
        self._look = None
        if not look.detections:
            return DetectionFrame("", UNKNOWN_ORIGIN, ()), stamp
        frame = None if depth is None else self._located(look, depth, now)
        if incomplete:
            self._input_faults.note("no_depth", self._names["detections_2d"], now)
        # Unread boxes make the frame not whole: somebody is there, at an unknown place.
        lost = (class_id_of(box.results) for box in look.detections)
        return frame or DetectionFrame("", UNKNOWN_ORIGIN, (), tuple(lost)), stamp

    def _located(
        self, look: Look, depth: ros.Image, now: float
    ) -> DetectionFrame | None:
        """Boxes of a detection frame; None where nothing of it can be located."""
        stamp = look.header.stamp.seconds
        place = self._places.in_map(depth.header.frame_id, stamp, now)
        if place is None or self._info is None:
            return None
        mask = nearest(self._masks, stamp)
        try:
            picture = read_depth(depth, self._info)
            return grounded(look, picture, mask, place, self._settings)
        except UnreadableError as error:
            self._input_faults.note(error.reason, self._names["depth"], now)
            return None
