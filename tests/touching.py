"""Whether emulated robots overlap each other or what stands still."""

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


def touches(scenery: Scenery, body: Body) -> bool:
    """Whether a robot overlaps anything, or the wall."""
    corners = body.corners()
    if not all(scenery.bounds.contains(x, y) for x, y in corners):
        return True
    boxes = [_box_corners(*sides) for sides in scenery.rectangles]
    posts = any(body.gap_to(x, y)[0] < radius for x, y, radius in scenery.posts)
    return posts or any(overlap(corners, box) for box in boxes)


def bodies_touch(bodies: Sequence[Body]) -> bool:
    """Whether any two robots overlap."""
    return any(
        overlap(one.corners(), other.corners())
        for index, one in enumerate(bodies)
        for other in bodies[:index]
    )
