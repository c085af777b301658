"""From a detector's mask and a depth picture to a box in metres: the paper's grounding.

The mask gives the target's pixels, the cloud their points; both together give a box,
which is transformed into the robot's or the map's frame.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError
from iveg.domain.geometry import Box3D
from iveg.domain.observations import UNKNOWN_ORIGIN, Detection, DetectionFrame

# --- mask -------------------------------------------------------------------------
#
# Pixels of a target without its fringe of leaves.
#
# Source: the seed paper, section "Spatial grounding": kernel area, erosion by opening.
# Its erosion formula is printed as::
#
#     M_eroded = ⋃ t=1..T  M(t-1) ∩ ¬[(M(t-1) ⊖ SE) ⊕ SE]
#
# Literally, this keeps the fringe, which an opening takes away, and throws the body
# away; with M(t) = M(t-1) ⊖ SE it is Lantuéjoul's morphological skeleton. The text asks
# for the opposite ("until peripheral artifacts detach"), so ``eroded`` keeps the body::
#
#     M_eroded = ((M ⊖ SE … ⊖ SE) ⊕ SE … ⊕ SE)      T times ⊖, then T - rim times ⊕
#
# ``rim = 0`` is the opening itself.  A cross has thin arms, and one that stands in the
# body still reaches into a leaf that touches it, so an opening leaves triangles of leaf
# at the silhouette.  Pixels not grown back (``rim`` > 0) are where they would be.

Mask = NDArray[np.bool_]
"""Shape (h, w): rows downwards, columns to the right."""

EDGE_LIMIT = 8192
"""Largest accepted edge of a picture (pixels)."""


def kernel_area(factor: float, least: float, most: float) -> float:
    """A_k = max(MINKERNEL, MAXKERNEL - e_c · MAXKERNEL / 100), in pixels.

    As printed, the kernel *shrinks* as the class's erosion factor e_c grows: 0 is the
    full kernel, 100 the least.  It is kept as printed - against the factor's name - so
    that factors tuned for a robot's existing grounding node mean the same here: e_c is
    the percentage of MAXKERNEL, 0 to 100, that a class is spared.
    """
    return max(least, most - factor * most / 100.0)


def kernel_size(area: float) -> int:
    """Edge of the cross-shaped element: k = ⌊√A_k⌋, at least one pixel."""
    return max(1, math.isqrt(int(area)))


def eroded(mask: Mask, size: int, iterations: int, rim: int = 0) -> Mask:
    """The mask without its fringe: a subset of the mask, empty only if that is.

    Args:
        mask: Mask of the detector; pixels outside of it do not belong.
        size: Edge of the cross (pixels); the middle of an even one is right of and
            below its centre.
        iterations: T.  Fewer are done where one more would leave nothing: a target
            that has been eroded away has no position, and that is worse than a fringe.
        rim: How many of the iterations are not grown back; 0 is the paper's opening.
    """
    before, after = size // 2, size - 1 - size // 2
    count, body = 0, mask
    while count < iterations:
        # M ⊖ SE is the spread complement: both operations share one fast routine.
        smaller = ~_spread(~body, before, after, outside=True)
        if not smaller.any():
            break
        body, count = smaller, count + 1
    for _ in range(count - rim):
        body = _spread(body, after, before, outside=False)
    return body


def _spread(mask: Mask, before: int, after: int, *, outside: bool) -> Mask:
    """Pixels that have a pixel of the mask within a cross of these arms: M ⊕ SE.

    Spreading the pixels outside of a mask gives all that M ⊖ SE lacks.
    """
    rows = _any_in_row(mask, before, after, outside=outside)
    return rows | _any_in_row(mask.T, before, after, outside=outside).T


def _any_in_row(mask: Mask, before: int, after: int, *, outside: bool) -> Mask:
    """Whether any pixel is set from ``before`` to the left to ``after`` to the right.

    By running sums, so that a wide cross costs no more than a narrow one.
    """
    edges, count = ((0, 0), (before + 1, after)), before + 1 + after
    sums = np.pad(mask, edges, constant_values=outside).cumsum(axis=1, dtype=np.int32)
    grown: Mask = sums[:, count:] > sums[:, :-count]
    return grown


# --- cloud ------------------------------------------------------------------------
#
# Depth picture registered to the detector's picture, as a point cloud.
#
# Frame: the camera's optical one - z forward, x right, y down (REP-103's ``_optical``)
# - in metres. Source: the seed paper, section "Spatial grounding": cloud index and
# depth discontinuity. Lens distortion is left out: registered pictures are rectified.

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A rectified camera with square pixels.

    Attributes:
        focal: Focal length (pixels).
        cx: Where the optical axis meets the picture (pixels); ``cy`` likewise.
    """

    width: int
    height: int
    focal: float
    cx: float
    cy: float


@dataclass(frozen=True, slots=True, eq=False)
class DepthPicture:
    """An organised cloud, kept as its depth.

    Attributes:
        depth: Shape (height, width), (m along the optical axis); zero, less, NaN and
            inf mean that nothing was measured.

    Raises:
        UnreadableError: The depth has another shape than the camera.
    """

    camera: Pinhole
    depth: NDArray[np.float32]

    def __post_init__(self) -> None:
        shape = self.camera.height, self.camera.width
        if self.depth.shape != shape:
            raise UnreadableError(
                "bad_depth_shape", f"{self.depth.shape} instead of {shape}"
            )

    def points(self, index: Indices) -> Floats:
        """The cloud's points p = (p_x, p_y, p_z) at pc_index; shape (n, 3), (m)."""
        rows = index // self.camera.width
        columns = index - rows * self.camera.width
        z = self.depth.reshape(-1)[index].astype(np.float64)
        x = (columns - self.camera.cx) / self.camera.focal * z
        y = (rows - self.camera.cy) / self.camera.focal * z
        return np.stack((x, y, z)).T

    def continuous(self, index: Indices, most: float) -> NDArray[np.bool_]:
        """|p_z,k - p_z,k-1| ≤ τ_max: whether each depth agrees with its left neighbour.

        The neighbour is the cloud's, inside the mask or not.  The paper does not define
        three cases: a pixel of the first column has no neighbour (k-1 is at the other
        edge, a row up) and is not accepted, nor is a pixel without a measurement or
        with an unmeasured neighbour; the bound itself is accepted.

        Args:
            index: pc_index, shape (n,).
            most: τ_max (m).
        """
        pairs = self.depth.reshape(-1)[np.stack((index, index - 1))].astype(np.float64)
        pairs[~((pairs > 0.0) & (pairs < np.inf))] = np.nan
        near: NDArray[np.bool_] = np.abs(pairs[0] - pairs[1]) <= most
        return near & (index % self.camera.width > 0)


def top_left(x_c: float, y_c: float, width: int, height: int) -> tuple[int, int]:
    """(x_tl, y_tl) = (x_c - w/2, y_c - h/2), to the nearest pixel (halves go up)."""
    return math.floor(x_c - width / 2 + 0.5), math.floor(y_c - height / 2 + 0.5)


def cloud_index(
    mask: NDArray[np.bool_], corner: tuple[int, int], camera: Pinhole
) -> Indices:
    """pc_index = (j + y_tl) · W + (i + x_tl) of every set pixel, in rising order.

    Detectors draw boxes over the picture's edge; what lies beyond it has no point and
    is left out.

    Args:
        mask: Shape (h, w); j is its row, i its column.
        corner: (x_tl, y_tl) of the mask in the picture (pixels).
        camera: Camera of the picture.
    """
    x_tl, y_tl = corner
    top, left = max(0, -y_tl), max(0, -x_tl)
    inside = mask[
        top : max(0, camera.height - y_tl), left : max(0, camera.width - x_tl)
    ]
    j, i = np.nonzero(inside)
    return (j + top + y_tl) * camera.width + (i + left + x_tl)


# --- locate -----------------------------------------------------------------------
#
# From mask and depth to the 3D box, its centre and its position in the work frame.
#
# Source: the seed paper, section "Spatial grounding", from the 3D box to P_work, and
# the table of object parameters; Algorithm 1's ``SpatialGrounding``. The printed box
# holds the *visible* surface only, so its centre stands before the true one: by about
# 0.18 m for a person, by half its length for a robot seen from behind.


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """Output of detector and mask network for one target.

    Attributes:
        class_id: As the network names it.
        probability: C_i, 0 to 1.
        x_c: Centre of the 2D box (pixels); ``y_c`` likewise.
        mask: Pixels of the box that are the target's; shape (height, width).
    """

    class_id: str
    probability: float
    x_c: float
    y_c: float
    mask: Mask


@dataclass(frozen=True, slots=True)
class Grounding:
    """Parameters that the paper leaves open; the defaults are assumed.

    Attributes:
        p_min: Least probability that is processed, inclusive.
        least_kernel: MINKERNEL (pixels); 9 is a cross of 3 × 3.
        most_kernel: MAXKERNEL, as share of the squared box width: a constant number of
            pixels that only trims a person at 1.5 m would eat one at 6 m.
        iterations: T; ``rim`` of them are not grown back (``eroded``).
        factor: e_c, 0 to 100.
        most_jump: τ_max (m).
    """

    p_min: float = 0.80
    least_kernel: float = 9.0
    most_kernel: float = 0.006
    iterations: int = 3
    rim: int = 2
    factor: float = 0.0
    most_jump: float = 0.10

    def cross(self, width: int) -> int:
        """Edge of the structuring element (pixels) in a box ``width`` wide."""
        most = self.most_kernel * width**2
        return kernel_size(kernel_area(self.factor, self.least_kernel, most))


DEFAULT = Grounding()


Ungrounded = Literal["unsure", "empty", "no_depth", "unreadable"]
"""Why a target has no position: ``unsure``: below p_min, by design; ``empty``: the mask
holds nothing of the picture; ``no_depth``: not one point passed the filter."""


def ground(
    segment: Segment, picture: DepthPicture, settings: Grounding = DEFAULT
) -> Box3D | Ungrounded:
    """Locate one target: its BB_3D in the camera's optical frame.

    The extremes are those of the accepted points (m): ``zmin`` is the nearest, and the
    box's centre is c_3D.
    """
    if segment.probability < settings.p_min:
        return "unsure"
    height, width = segment.mask.shape
    cross = settings.cross(width)
    body = eroded(segment.mask, cross, settings.iterations, settings.rim)
    corner = top_left(segment.x_c, segment.y_c, width, height)
    index = cloud_index(body, corner, picture.camera)
    if not index.size:
        return "empty"
    accepted = index[picture.continuous(index, settings.most_jump)]
    if not accepted.size:
        return "no_depth"
    return hull_of(picture.points(accepted))


def frame_of(
    answers: Sequence[tuple[str | None, Detection | Ungrounded]],
) -> DetectionFrame:
    """The detection frame of all targets of a picture, each with its class.

    A target that is sure enough but has no place counts as unread.  A frame without
    it would look empty although somebody is there.
    """
    placed = tuple(answer for _, answer in answers if isinstance(answer, Detection))
    unplaced = tuple(
        class_id
        for class_id, answer in answers
        if answer != "unsure" and not isinstance(answer, Detection)
    )
    return DetectionFrame("", UNKNOWN_ORIGIN, placed, unplaced)


def hull_of(points: Floats) -> Box3D:
    """BB_3D: the axis-aligned box of points, shape (n, 3)."""
    sides = np.stack((points.min(axis=0), points.max(axis=0)), axis=1)
    return Box3D(*sides.reshape(-1).tolist())


def corners_of(box: Box3D) -> Floats:
    """The corners of a box, shape (8, 3)."""
    sides = (box.xmin, box.xmax), (box.ymin, box.ymax), (box.zmin, box.zmax)
    return np.stack(np.meshgrid(*sides), axis=-1).reshape(8, 3)
