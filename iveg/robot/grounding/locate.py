"""From mask and depth to the 3D box, its centre and its position in the work frame.

Source: the seed paper, section "Spatial grounding", from the 3D box to P_work, and the
table of object parameters; Algorithm 1's ``SpatialGrounding``.  The printed box holds
the *visible* surface only, so its centre stands before the true one: by about 0.18 m
for a person, by half its length for a robot seen from behind.  ``Grounding.hidden``
mends it where it is known.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from iveg.domain.errors import UnreadableError
from iveg.domain.fleet import RobotProfile
from iveg.domain.geometry import Box3D, Pose2D
from iveg.domain.observations import Detection, DetectionFrame, Origin
from iveg.robot.grounding.cloud import DepthPicture, Floats, cloud_index, top_left
from iveg.robot.grounding.mask import (
    Mask,
    eroded,
    kernel_area,
    kernel_size,
    read_mask,
)


@dataclass(frozen=True, slots=True)
class Segment:
    """Output of detector and mask network for one target.

    Attributes:
        class_id: As the network names it.
        probability: C_i, 0 to 1.
        x_c: Centre of the 2D box (pixels); ``y_c`` likewise.
        width: Of the box and of the mask that is cropped to it (pixels); ``height``.
        bits: The mask, one bit a pixel (``mask.read_mask``).
    """

    class_id: str
    probability: float
    x_c: float
    y_c: float
    width: int
    height: int
    bits: bytes


@dataclass(frozen=True, slots=True)
class Grounding:
    """Parameters that the paper leaves open; the defaults are assumed.

    Attributes:
        p_min: Least probability that is processed, inclusive.
        least_kernel: MINKERNEL (pixels); 9 is a cross of 3 × 3.
        most_kernel: MAXKERNEL, as share of the squared box width: a constant number of
            pixels that only trims a person at 1.5 m would eat one at 6 m.
        iterations: T; ``rim`` of them are not grown back (``mask.eroded``).
        factors: e_c by class, 0 to 100; ``factor`` for any other.
        most_jump: τ_max (m).
        hidden: How far a class goes on behind what is seen of it (m), added to the far
            face; none by default, which is the paper's box.  0.36 fits a person.
    """

    p_min: float = 0.80
    least_kernel: float = 9.0
    most_kernel: float = 0.006
    iterations: int = 3
    rim: int = 2
    factors: Mapping[str, float] = field(default_factory=dict)
    factor: float = 0.0
    most_jump: float = 0.10
    hidden: Mapping[str, float] = field(default_factory=dict)

    def cross(self, class_id: str, width: int) -> int:
        """Edge of the structuring element (pixels) in a box ``width`` wide."""
        factor = self.factors.get(class_id, self.factor)
        most = self.most_kernel * width**2
        return kernel_size(kernel_area(factor, self.least_kernel, most))


DEFAULT = Grounding()


@dataclass(frozen=True, slots=True)
class Grounded:
    """One row of the paper's object table, in the camera's optical frame.

    Attributes:
        box: BB_3D: extremes over the accepted points (m); ``zmin`` is the nearest, and
            its centre is c_3D.
        points: How many points were accepted.
    """

    class_id: str
    probability: float
    box: Box3D
    points: int


Ungrounded = Literal["unsure", "empty", "no_depth", "unreadable"]
"""Why a target has no position: ``unsure``: below p_min, by design; ``empty``: the mask
holds nothing of the picture; ``no_depth``: not one point passed the filter."""


@dataclass(frozen=True, slots=True)
class Mount:
    """Mounting pose of a camera in ``base_link``; it looks level along x."""

    pose: Pose2D
    height: float

    @classmethod
    def of(cls, profile: RobotProfile) -> "Mount":
        """The camera of a kind of robot."""
        return cls(profile.camera, profile.camera_height)


def ground(
    segment: Segment, picture: DepthPicture, settings: Grounding = DEFAULT
) -> Grounded | Ungrounded:
    """Locate one target in the camera's optical frame.

    Raises:
        UnreadableError: A probability, position or mask out of range.
    """
    _examine(segment)
    if segment.probability < settings.p_min:
        return "unsure"
    index = cloud_index(
        body_of(segment, settings),
        top_left(segment.x_c, segment.y_c, segment.width, segment.height),
        picture.camera,
    )
    if not index.size:
        return "empty"
    accepted = index[picture.continuous(index, settings.most_jump)]
    if not accepted.size:
        return "no_depth"
    box = hull_of(picture.points(accepted))
    behind = settings.hidden.get(segment.class_id, 0.0)
    box = replace(box, zmax=box.zmax + behind)
    return Grounded(segment.class_id, segment.probability, box, accepted.size)


def body_of(segment: Segment, settings: Grounding = DEFAULT) -> Mask:
    """The segment's mask without its fringe (M_eroded); shape (height, width)."""
    mask = read_mask(segment.bits, segment.width, segment.height)
    cross = settings.cross(segment.class_id, segment.width)
    return eroded(mask, cross, settings.iterations, settings.rim)


def to_detection(
    found: Grounded, mount: Mount, robot: Pose2D | None = None
) -> Detection:
    """P_work = T · P_sensor: the box in ``base_link``, or in ``map`` given a pose.

    The box is the hull of the turned one, so its centre is the turned centre.

    Args:
        found: In the camera's optical frame.
        mount: Of the camera in ``base_link``.
        robot: Pose of ``base_link`` in ``map`` when the picture was taken.
    """
    sensor = mount.pose if robot is None else robot.compose(mount.pose)
    box = hull_of(_to_work(corners_of(found.box), sensor, mount.height))
    frame: Literal["map", "base_link"] = "base_link" if robot is None else "map"
    return Detection(found.class_id, found.probability, box, frame)


def ground_frame(
    robot_id: str,
    origin: Origin,
    segments: Iterable[Segment],
    picture: DepthPicture,
    mount: Mount,
    settings: Grounding = DEFAULT,
) -> DetectionFrame:
    """One frame of the detector as the robot reports it, boxes in ``base_link``."""
    answers = [
        (one.class_id, _answer(one, picture, mount, settings)) for one in segments
    ]
    return frame_of(robot_id, origin, answers)


def _answer(
    segment: Segment, picture: DepthPicture, mount: Mount, settings: Grounding
) -> Detection | Ungrounded:
    try:
        found = ground(segment, picture, settings)
    except UnreadableError:
        return "unreadable"
    return to_detection(found, mount) if isinstance(found, Grounded) else found


def frame_of(
    robot_id: str,
    origin: Origin,
    answers: Sequence[tuple[str | None, Detection | Ungrounded]],
) -> DetectionFrame:
    """The detection frame of all targets of a picture, each with its class.

    A target that is sure enough and still has no place counts as unread: that
    somebody is there and nobody knows where must not look like an empty frame.
    """
    found = tuple(one for _, one in answers if isinstance(one, Detection))
    lost = tuple(
        class_id
        for class_id, one in answers
        if one != "unsure" and not isinstance(one, Detection)
    )
    return DetectionFrame(robot_id, origin, found, lost)


def _examine(segment: Segment) -> None:
    if not 0.0 <= segment.probability <= 1.0:
        raise UnreadableError("bad_probability", f"{segment.probability}")
    if not (math.isfinite(segment.x_c) and math.isfinite(segment.y_c)):
        raise UnreadableError("bad_centre", f"{segment.x_c}, {segment.y_c}")


def hull_of(points: Floats) -> Box3D:
    """BB_3D: the axis-aligned box of points, shape (n, 3)."""
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return Box3D(low[0], high[0], low[1], high[1], low[2], high[2])


def corners_of(box: Box3D) -> Floats:
    """The corners of a box, shape (8, 3)."""
    sides = (box.xmin, box.xmax), (box.ymin, box.ymax), (box.zmin, box.zmax)
    return np.stack(np.meshgrid(*sides), axis=-1).reshape(8, 3)


def _to_work(points: Floats, sensor: Pose2D, height: float) -> Floats:
    """Optical frame (z forward, x right, y down) to REP-103 (z up), turned."""
    right, down, ahead = points.T
    c, s = math.cos(sensor.yaw), math.sin(sensor.yaw)
    x = sensor.x + c * ahead + s * right
    y = sensor.y + s * ahead - c * right
    return np.stack((x, y, height - down), axis=1)
