"""Whether emulated robots overlap each other or what stands still."""

import math
from collections.abc import Sequence

import numpy as np

from iveg.lab.emulator.greenhouse import Body, Floats, Scenery


def _box_corners(xmin: float, ymin: float, xmax: float, ymax: float) -> Floats:
    return np.array(((xmax, ymax), (xmin, ymax), (xmin, ymin), (xmax, ymin)))


def overlap(first: Floats, second: Floats) -> bool:
    """Whether two convex quadrilaterals overlap (separating axis theorem)."""
    return not any(
        _separates(edge, first, second)
        for shape in (first, second)
        for edge in np.roll(shape, -1, axis=0) - shape
    )


def _separates(edge: Floats, first: Floats, second: Floats) -> bool:
    normal = np.array((-edge[1], edge[0]))
    one, other = first @ normal, second @ normal
    return bool(one.max() < other.min() or other.max() < one.min())


def _near(corners: Floats, boxes: Floats) -> Floats:
    """Those boxes that the upright box about some corners overlaps: most are far away.

    Args:
        corners: Shape (k, 2).
        boxes: Shape (n, 4): xmin, ymin, xmax, ymax.
    """
    least, most = corners.min(axis=0), corners.max(axis=0)
    near = ((boxes[:, :2] <= most) & (boxes[:, 2:] >= least)).all(axis=1)
    found: Floats = boxes[near]
    return found


def touches(scenery: Scenery, body: Body) -> bool:
    """Whether a robot overlaps anything, or the wall."""
    corners = body.corners()
    if not all(scenery.bounds.contains(x, y) for x, y in corners):
        return True
    posts = any(body.gap_to(x, y)[0] < radius for x, y, radius in scenery.posts)
    return posts or any(
        overlap(corners, _box_corners(*sides))
        for sides in _near(corners, scenery.rectangles)
    )


def bodies_touch(bodies: Sequence[Body]) -> bool:
    """Whether any two robots overlap."""
    return any(
        overlap(one.corners(), other.corners())
        for index, one in enumerate(bodies)
        for other in bodies[:index]
        if one.pose.distance_to(other.pose.x, other.pose.y) <= _reach(one, other)
    )


def _reach(one: Body, other: Body) -> float:
    """Farther apart (m) no corners meet."""
    return sum(math.hypot(body.length, body.width) / 2 for body in (one, other))
