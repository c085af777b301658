"""Depth picture registered to the detector's picture, as a point cloud.

Frame: the camera's optical one - z forward, x right, y down (REP-103's ``_optical``) -
in metres.  Source: the seed paper, section "Spatial grounding": cloud index and depth
discontinuity.  Lens distortion is left out: registered pictures are rectified.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError

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

    @classmethod
    def across(cls, fov: float, width: int = 640, height: int = 480) -> "Pinhole":
        """A camera that sees ``fov`` (rad) from its left edge to its right one."""
        focal = width / 2 / math.tan(fov / 2)
        return cls(width, height, focal, (width - 1) / 2, (height - 1) / 2)


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
