"""Pixels of a target: the detector's bitset without its fringe of leaves.

Source: the seed paper, section "Spatial grounding": membership and bit position,
kernel area, erosion by opening.  Its erosion formula is printed as::

    M_eroded = ⋃ t=1..T  M(t-1) ∩ ¬[(M(t-1) ⊖ SE) ⊕ SE]

Run literally that keeps what an opening takes away - the fringe - and throws the body
away; with M(t) = M(t-1) ⊖ SE it is Lantuéjoul's morphological skeleton.  The text asks
for the opposite ("until peripheral artifacts detach"), so ``eroded`` keeps the body::

    M_eroded = ((M ⊖ SE … ⊖ SE) ⊕ SE … ⊕ SE)      T times ⊖, then T - rim times ⊕

``rim = 0`` is the opening itself.  A cross has thin arms, and one that stands in the
body still reaches into a leaf that touches it, so an opening leaves triangles of leaf
at the silhouette.  What is not grown back (``rim`` > 0) is where they would be.
"""

import math

import numpy as np
from numpy.typing import NDArray

from iveg.domain.errors import UnreadableError

Mask = NDArray[np.bool_]
"""Shape (h, w): rows downwards, columns to the right."""

EDGE_LIMIT = 8192
"""Largest accepted edge of a picture (pixels)."""


def read_mask(bits: bytes, width: int, height: int) -> Mask:
    """Whether each pixel is the target's (the membership equation).

    Column x of row y has index = y·w + x, byte b = ⌊index / 8⌋ and bit
    n = 7 - (index mod 8): rows follow each other without padding, the first pixel is a
    byte's highest bit.

    Returns:
        Shape (height, width).

    Raises:
        UnreadableError: The size is not positive, or differs from the number of bytes.
    """
    if not (0 < width <= EDGE_LIMIT and 0 < height <= EDGE_LIMIT):
        raise UnreadableError("bad_mask_size", f"{width} × {height} pixels")
    count = width * height
    if len(bits) != math.ceil(count / 8):
        raise UnreadableError(
            "bad_mask_bytes", f"{len(bits)} bytes for {width} × {height} pixels"
        )
    flat = np.unpackbits(np.frombuffer(bits, np.uint8), count=count)
    return flat.reshape(height, width).astype(np.bool_)


def write_mask(mask: Mask) -> bytes:
    """The bitset of a mask; the inverse of ``read_mask``."""
    return np.packbits(mask).tobytes()


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
