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
# Run literally that keeps what an opening takes away - the fringe - and throws the body
# away; with M(t) = M(t-1) ⊖ SE it is Lantuéjoul's morphological skeleton. The text asks
# for the opposite ("until peripheral artifacts detach"), so ``eroded`` keeps the body::
#
#     M_eroded = ((M ⊖ SE … ⊖ SE) ⊕ SE … ⊕ SE)      T times ⊖, then T - rim times ⊕
#
# ``rim = 0`` is the opening itself.  A cross has thin arms, and one that stands in the
# body still reaches into a leaf that touches it, so an opening leaves triangles of leaf
# at the silhouette.  What is not grown back (``rim`` > 0) is where they would be.

Mask = NDArray[np.bool_]
"""Shape (h, w): rows downwards, columns to the right."""

EDGE_LIMIT = 8192
"""Largest accepted edge of a picture (pixels)."""


def kernel_area(factor: float, least: float, most: float) -> float:
    """A_k = max(MINKERNEL, MAXKERNEL - e_c · MAXKERNEL / 100), in pixels.

    As printed, the kernel *shrinks* as the class's erosion factor e_c grows: 0 is the
    full kernel, 100 the least.  It is kept as printed - against the factor's name - so
    that factors tuned for a robot's existing grounding node mean the same here: e_c is
    the percentage of MAXKERNEL that a class is spared.

    Raises:
        UnreadableError: The factor is not within 0 to 100.
    """
    if not 0.0 <= factor <= 100.0:
        raise UnreadableError("bad_erosion_factor", f"{factor} is not within 0 to 100")
    return max(least, most - factor * most / 100.0)


def kernel_size(area: float) -> int:
    """Edge of the cross-shaped element: k = ⌊√A_k⌋, at least one pixel."""
    return max(1, math.isqrt(int(area)))


def eroded(mask: Mask, size: int, iterations: int, rim: int = 0) -> Mask:
    """The mask without its fringe: a subset of the mask, empty only if that is.

    Args:
        mask: As the detector gave it; pixels outside of it do not belong.
        size: Edge of the cross (pixels); the middle of an even one is right of and
            below its centre.
        iterations: T.  Fewer are done where one more would leave nothing: a target
            that has been eroded away has no position, and that is worse than a fringe.
        rim: How many of the iterations are not grown back; 0 is the paper's opening.
    """
    done = 0
    body = mask
    while done < iterations:
        smaller = _erode(body, size)
        if not smaller.any():
            break
        body, done = smaller, done + 1
    for _ in range(done - rim):
        body = _dilate(body, size)
    return body


def _erode(mask: Mask, size: int) -> Mask:
    """M ⊖ SE: pixels whose whole cross lies in the mask."""
    before, after = size // 2, size - 1 - size // 2
    rows = ~_any_along(~mask, 0, before, after, outside=True)
    columns = ~_any_along(~mask, 1, before, after, outside=True)
    return rows & columns


def _dilate(mask: Mask, size: int) -> Mask:
    """M ⊕ SE: pixels that the cross of some pixel of the mask covers."""
    before, after = size // 2, size - 1 - size // 2
    rows = _any_along(mask, 0, after, before, outside=False)
    return rows | _any_along(mask, 1, after, before, outside=False)


def _any_along(
    mask: Mask, axis: int, before: int, after: int, *, outside: bool
) -> Mask:
    """Whether any of the ``before`` pixels up to the ``after`` ones is set.

    Runs double in length, so a cross of k pixels costs log₂ k steps.
    """
    edges = [(0, 0), (0, 0)]
    edges[axis] = (before, after)
    run = np.pad(mask, edges, constant_values=outside)
    length, wanted = 1, before + 1 + after
    while length < wanted:
        step = min(length, wanted - length)
        end = run.shape[axis] - step
        run = run[:end] | run[step:] if axis == 0 else run[:, :end] | run[:, step:]
        length += step
    return run


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
    """An organised cloud, kept as the depth it is made of.

    Attributes:
        depth: Shape (height, width), (m along the optical axis); zero, less, NaN and
            inf mean that nothing was measured.

    Raises:
        UnreadableError: The depth has another shape than the camera.
    """

    camera: Pinhole
    depth: NDArray[np.float32]

    def __post_init__(self) -> None:
        wanted = self.camera.height, self.camera.width
        if self.depth.shape != wanted:
            raise UnreadableError(
                "bad_depth_shape", f"{self.depth.shape} instead of {wanted}"
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
        depth = self.depth.reshape(-1)
        here = depth[index].astype(np.float64)
        left = depth[index - 1].astype(np.float64)
        measured = (here > 0.0) & (left > 0.0) & (here < np.inf) & (left < np.inf)
        jump = np.subtract(here, left, out=np.full(here.shape, np.nan), where=measured)
        near: NDArray[np.bool_] = np.abs(jump) <= most
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
        camera: Whose picture it is.
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
        iterations: T; ``rim`` of them are not grown back (``mask.eroded``).
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


def ground(
    segment: Segment, picture: DepthPicture, settings: Grounding = DEFAULT
) -> Grounded | Ungrounded:
    """Locate one target in the camera's optical frame.

    Raises:
        UnreadableError: The probability is out of range.
    """
    if not 0.0 <= segment.probability <= 1.0:
        raise UnreadableError("bad_probability", f"{segment.probability}")
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
    box = hull_of(picture.points(accepted))
    return Grounded(segment.class_id, segment.probability, box, accepted.size)


def frame_of(
    answers: Sequence[tuple[str | None, Detection | Ungrounded]],
) -> DetectionFrame:
    """The detection frame of all targets of a picture, each with its class.

    A target that is sure enough and still has no place counts as unread: that
    somebody is there and nobody knows where must not look like an empty frame.
    """
    found = tuple(answer for _, answer in answers if isinstance(answer, Detection))
    lost = tuple(
        class_id
        for class_id, answer in answers
        if answer != "unsure" and not isinstance(answer, Detection)
    )
    return DetectionFrame("", UNKNOWN_ORIGIN, found, lost)


def hull_of(points: Floats) -> Box3D:
    """BB_3D: the axis-aligned box of points, shape (n, 3)."""
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return Box3D(low[0], high[0], low[1], high[1], low[2], high[2])


def corners_of(box: Box3D) -> Floats:
    """The corners of a box, shape (8, 3)."""
    sides = (box.xmin, box.xmax), (box.ymin, box.ymax), (box.zmin, box.zmax)
    return np.stack(np.meshgrid(*sides), axis=-1).reshape(8, 3)
