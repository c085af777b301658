"""Detections without depth: boxes in a picture, located by a depth picture.

The paper's grounding (``iveg.robot.grounding``) on the boxes of a picture, a depth
``Image`` registered to the detector's camera, and its ``CameraInfo``.  In a mask
picture value n marks the n-th detection, counted from 1, and 255 marks any.
Without a mask the target is the part of the box at about the depth of its middle: the
whole box would include the wall behind a person.
"""

from collections.abc import Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError
from iveg.domain.observations import UNKNOWN_ORIGIN, Detection, DetectionFrame
from iveg.robot.grounding.cloud import DepthPicture, Pinhole, top_left
from iveg.robot.grounding.locate import (
    Grounded,
    Grounding,
    Segment,
    Ungrounded,
    corners_of,
    frame_of,
    ground,
    hull_of,
)
from iveg.robot.grounding.mask import EDGE_LIMIT, write_mask
from iveg.robot.ros2.detectors import Look
from iveg.robot.ros2.reading import class_id_of, read_hypothesis, within_world
from iveg.robot.ros2.rigid import RigidTransform
from iveg.ros2 import sensor_msgs, vision_msgs

_Pixel = TypeVar("_Pixel", bound=np.generic)

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


def nearest(
    pictures: Iterable[sensor_msgs.Image], stamp: float, within_s: float
) -> sensor_msgs.Image | None:
    """The picture of a stamp, within ``within_s``."""
    best = min(
        pictures, key=lambda one: abs(one.header.stamp.seconds - stamp), default=None
    )
    if best is None or abs(best.header.stamp.seconds - stamp) > within_s:
        return None
    return best


def read_camera(info: sensor_msgs.CameraInfo) -> Pinhole:
    """A rectified camera.

    Raises:
        UnreadableError: ``bad_camera``: no focal length, or pixels that are not square.
    """
    fx, fy, cx, cy = (float(info.p[n]) for n in (0, 5, 2, 6))
    if fx == 0.0:  # drivers of rectified cameras may omit p
        fx, fy, cx, cy = (float(info.k[n]) for n in (0, 4, 2, 5))
    usable = all(map(np.isfinite, (fx, fy, cx, cy))) and fx > 0.0
    if not usable or abs(fx - fy) > _SQUARE * fx:
        raise UnreadableError("bad_camera", f"focal lengths {fx:g} and {fy:g}")
    return Pinhole(info.width, info.height, fx, cx, cy)


def read_depth(image: sensor_msgs.Image, info: sensor_msgs.CameraInfo) -> DepthPicture:
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


def _pixels(image: sensor_msgs.Image, kind: str) -> NDArray[np.generic]:
    dtype = np.dtype((">" if image.is_bigendian else "<") + kind)
    width, height, step = image.width, image.height, image.step
    fits = 0 < width <= EDGE_LIMIT and 0 < height <= EDGE_LIMIT
    if not fits or step < width * dtype.itemsize or image.data.size < step * height:
        raise UnreadableError("bad_picture", f"{width} × {height}, {image.data.size}")
    rows = image.data[: step * height].reshape(height, step)
    whole = np.ascontiguousarray(rows[:, : width * dtype.itemsize])
    return whole.view(dtype)


def grounded(
    look: Look,
    picture: DepthPicture,
    mask: sensor_msgs.Image | None,
    place: RigidTransform,
    classes: tuple[str, ...],
    settings: Grounding,
) -> DetectionFrame:
    """One detection frame with its boxes in ``map``.

    Args:
        look: Detections of the picture.
        picture: Depth at that moment.
        mask: Detection of each pixel; None: the whole box.
        place: Pose of the camera's optical frame in ``map``.
        classes: Names by number.
        settings: Parameters that the paper leaves open.

    Raises:
        UnreadableError: ``bad_picture``: the detector's picture has another size.
    """
    camera = picture.camera
    if look.width and (look.width, look.height) != (camera.width, camera.height):
        detail = f"boxes in {look.width} × {look.height}"
        raise UnreadableError("bad_picture", detail)
    owners = None if mask is None else _pixels(mask, _MASKS.get(mask.encoding, "u1"))
    answers = [
        (
            class_id_of(one.results, classes),
            _place(number, one, picture, owners, place, classes, settings),
        )
        for number, one in enumerate(look.detections, 1)
    ]
    return frame_of("", UNKNOWN_ORIGIN, answers)


def _place(
    number: int,
    seen: vision_msgs.Detection2D,
    picture: DepthPicture,
    owners: NDArray[np.generic] | None,
    place: RigidTransform,
    classes: tuple[str, ...],
    settings: Grounding,
) -> Detection | Ungrounded:
    try:
        segment = _segment(number, seen, picture, owners, classes)
        answer = ground(segment, picture, settings)
    except UnreadableError:
        return "unreadable"
    if not isinstance(answer, Grounded):
        return answer
    hull = within_world(hull_of(place.of(corners_of(answer.box))))
    return Detection(answer.class_id, answer.probability, hull, "map")


def _segment(
    number: int,
    seen: vision_msgs.Detection2D,
    picture: DepthPicture,
    owners: NDArray[np.generic] | None,
    classes: tuple[str, ...],
) -> Segment:
    class_id, probability = read_hypothesis(seen.results, classes)
    centre, box = seen.bbox.center.position, seen.bbox
    numbers = centre.x, centre.y, box.size_x, box.size_y
    if not all(map(np.isfinite, numbers)) or max(map(abs, numbers)) > EDGE_LIMIT:
        raise UnreadableError("bad_box", "a box that is none")
    width, height = max(1, round(box.size_x)), max(1, round(box.size_y))
    corner = top_left(centre.x, centre.y, width, height)
    if owners is None:
        own = _as_far_as_the_middle(_cut(picture.depth, corner, width, height))
    else:
        part = _cut(owners, corner, width, height)
        own = (part == number) | (part == _ANY)
    bits = write_mask(own)
    return Segment(class_id, probability, centre.x, centre.y, width, height, bits)


def _cut(
    picture: NDArray[_Pixel], corner: tuple[int, int], width: int, height: int
) -> NDArray[_Pixel]:
    """Part of a picture, zero beyond its edges; shape (height, width)."""
    left, top = corner
    part = np.zeros((height, width), picture.dtype)
    rows, columns = picture.shape
    y0, y1 = max(0, top), min(rows, top + height)
    x0, x1 = max(0, left), min(columns, left + width)
    if y0 < y1 and x0 < x1:
        part[y0 - top : y1 - top, x0 - left : x1 - left] = picture[y0:y1, x0:x1]
    return part


def _as_far_as_the_middle(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Pixels within half a metre of the depth at the middle of a box."""
    height, width = depth.shape
    middle = depth[height // 4 : -(-3 * height // 4), width // 4 : -(-3 * width // 4)]
    measured = middle[np.isfinite(middle) & (middle > 0.0)]
    if not measured.size:
        return np.zeros(depth.shape, np.bool_)
    near: NDArray[np.bool_] = np.abs(depth - np.median(measured)) <= _THICK_M
    return near & (depth > 0.0)
