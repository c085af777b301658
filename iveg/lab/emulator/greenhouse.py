"""Greenhouse geometry as arrays: obstacles for rays and for robots.

The domain's ``Greenhouse`` names objects; this module only has rectangles and discs, in
``map`` (m), laid out for NumPy.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.witness import Plan

Floats = NDArray[np.float64]
Span = tuple[Floats, Floats]
"""Where rays enter and leave (m); a ray that leaves before it enters misses."""
_LEANS_M, _TUFT_M = 0.2, 0.15
"""How far a plant leans out at most, and the radius of its tuft (m)."""
_LEAST_SLOPE = 1e-9
"""Stands for zero in a direction, so that no division is by zero."""


def into(frame: Pose2D, x: float, y: float) -> tuple[float, float]:
    """A point of ``map`` in a frame with this pose; inverse of its ``transform``."""
    return frame.inverse(x, y)


@dataclass(frozen=True, slots=True)
class Disc:
    """A person seen from above (m)."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class Body:
    """A robot seen from above: a rectangle centred on its ``base_link`` (m)."""

    robot_id: str
    pose: Pose2D
    length: float
    width: float

    def corners(self) -> Floats:
        """Shape (4, 2), counter-clockwise from the front left."""
        x, y = self.length / 2, self.width / 2
        around = ((x, y), (-x, y), (-x, -y), (x, -y))
        return np.array([self.pose.transform(*corner) for corner in around])

    def discs(self) -> tuple[Disc, ...]:
        """Three discs along the body that cover all but its corners."""
        reach = self.length / 2 - self.width / 2
        places = (self.pose.transform(along, 0.0) for along in (-reach, 0.0, reach))
        return tuple(Disc(x, y, self.width / 2) for x, y in places)

    def span(self, rays: Floats, sensor: Pose2D) -> Span:
        """Rays of a sensor through the body; directions of shape (2, n)."""
        c, s = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        x, y = into(self.pose, sensor.x, sensor.y)
        half = self.length / 2, self.width / 2
        turned = np.array(((c, s), (-s, c))) @ rays
        box = np.array((-half[0], -half[1], *half))
        return box_span(turned, Pose2D(x, y, 0.0), box)

    def gap_to(self, x: float, y: float) -> tuple[float, float, float]:
        """Distance from a point to the rectangle, and the direction away from it.

        Returns:
            Distance (m, 0 inside) and the unit vector from the body to the point.
        """
        ahead, left = into(self.pose, x, y)
        out_x = ahead - min(max(ahead, -self.length / 2), self.length / 2)
        out_y = left - min(max(left, -self.width / 2), self.width / 2)
        gap = math.hypot(out_x, out_y)
        if gap == 0.0:
            out_x, out_y = 0.0, math.copysign(1.0, left)
        size = math.hypot(out_x, out_y)
        out_x, out_y = out_x / size, out_y / size
        c, s = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        return gap, c * out_x - s * out_y, s * out_x + c * out_y


@dataclass(frozen=True, slots=True, eq=False)
class Scenery:
    """All static objects.

    Attributes:
        bounds: The outer wall.
        rectangles: Shape (n, 4): xmin, ymin, xmax, ymax of crop, crates, trolleys.
        posts: Shape (m, 3): x, y, radius.
        leaves: Shape (k, 3), likewise: plants that lean out of their row, which lasers
            see and no plan draws.
        screens: Objects that occlude cameras: crop, crates, trolleys.
    """

    bounds: Rectangle
    rectangles: Floats
    posts: Floats
    leaves: Floats
    screens: tuple[Rectangle, ...]

    @classmethod
    def of(
        cls, greenhouse: Greenhouse, rng: np.random.Generator | None = None
    ) -> "Scenery":
        """Arrays of a greenhouse; ``rng`` lets its plants lean."""
        screens = greenhouse.rows + tuple(thing.area for thing in greenhouse.obstacles)
        plan = Plan.of(greenhouse)
        return cls(
            plan.bounds,
            plan.rectangles,
            plan.posts,
            np.empty((0, 3)) if rng is None else _leaves(greenhouse.rows, rng),
            screens,
        )

    def moved(self, east_m: float) -> "Scenery":
        """The same with all that stands within the walls so far to the east."""
        along = np.array([east_m, 0.0, east_m, 0.0])
        return replace(
            self,
            rectangles=self.rectangles + along,
            posts=self.posts + along[:3] * (1.0, 0.0, 0.0),
            leaves=self.leaves + along[:3] * (1.0, 0.0, 0.0),
            screens=tuple(
                replace(one, xmin=one.xmin + east_m, xmax=one.xmax + east_m)
                for one in self.screens
            ),
        )

    def hides(self, ax: float, ay: float, bx: float, by: float) -> bool:
        """Whether an object occludes the line between two points."""
        return any(area.crosses(ax, ay, bx, by) for area in self.screens)

    def free(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc fits at a position."""
        inside = self.bounds.contains(x, y, -radius)
        return inside and not any(s.contains(x, y, radius) for s in self.screens)


def _leaves(rows: Iterable[Rectangle], rng: np.random.Generator) -> Floats:
    """A tuft a metre along both sides of each row, up to 0.2 m outside of it."""
    tufts = [tuft for row in rows for tuft in _tufts(row, rng)]
    return np.array(tufts, float).reshape(-1, 3)


def _tufts(
    row: Rectangle, rng: np.random.Generator
) -> Iterator[tuple[float, float, float]]:
    along_x = row.xmax - row.xmin >= row.ymax - row.ymin
    first, last, *edges = (
        (row.xmin, row.xmax, row.ymin, row.ymax)
        if along_x
        else (row.ymin, row.ymax, row.xmin, row.xmax)
    )
    for edge, out in zip(edges, (-1.0, 1.0), strict=True):
        for along in np.arange(first + rng.uniform(0.2, 0.8), last, 1.0):
            across = edge + out * (rng.uniform(0.0, _LEANS_M) - _TUFT_M)
            yield (*((along, across) if along_x else (across, along)), _TUFT_M)


def slab_span(slope: Floats, low: Floats | float, high: Floats | float) -> Span:
    """Rays of a slope between two parallel planes."""
    steep = np.where(np.abs(slope) < _LEAST_SLOPE, _LEAST_SLOPE, slope)
    one, other = low / steep, high / steep
    return np.minimum(one, other), np.maximum(one, other)


def box_span(rays: Floats, origin: Pose2D, boxes: Floats) -> Span:
    """Rays through boxes by the slab method, in the boxes' frame.

    Args:
        rays: Directions, shape (2, n).
        origin: Of the rays.
        boxes: xmin, ymin, xmax, ymax; shape (…, 4).

    Returns:
        Two of shape (…, n).
    """
    sides = boxes[..., None]
    x = slab_span(rays[0], sides[..., 0, :] - origin.x, sides[..., 2, :] - origin.x)
    y = slab_span(rays[1], sides[..., 1, :] - origin.y, sides[..., 3, :] - origin.y)
    return np.maximum(x[0], y[0]), np.minimum(x[1], y[1])


def sides_of(area: Rectangle) -> Floats:
    """A rectangle as ``box_span`` reads it."""
    return np.array((area.xmin, area.ymin, area.xmax, area.ymax), float)
