"""Greenhouse geometry as arrays: obstacles for rays and for robots, and a planar laser.

The domain's ``Greenhouse`` names objects; this module only has rectangles and discs, in
``map`` (m), laid out for NumPy.  Ray casting by the slab method for rectangles and by
the quadratic for discs, all rays of a sweep in a few NumPy calls
(``benchmarks/lidar_cost.py`` says what it costs).  Left out: intensity, motion during
the sweep, leaves that move.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D, Rectangle
from iveg.domain.greenhouse import Greenhouse
from iveg.domain.laser import Plan

Floats = NDArray[np.float64]
Span = tuple[Floats, Floats]
"""Distances at which rays enter and leave (m); a ray that leaves first misses."""
_LEANS_M, _TUFT_M = 0.2, 0.15
"""Farthest that a plant leans out, and the radius of its tuft (m)."""
_LEAST_SLOPE = 1e-9
"""Replaces zero in a direction, so that no division is by zero."""


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
        x, y = self.pose.inverse(sensor.x, sensor.y)
        half = self.length / 2, self.width / 2
        turned = np.array(((c, s), (-s, c))) @ rays
        box = np.array((-half[0], -half[1], *half))
        return box_span(turned, Pose2D(x, y, 0.0), box)

    def gap_to(self, x: float, y: float) -> tuple[float, float, float]:
        """Distance from a point to the rectangle, and the direction away from it.

        Returns:
            Distance (m, 0 inside) and the unit vector from the body to the point.
        """
        front, left = self.pose.inverse(x, y)
        out_x = front - min(max(front, -self.length / 2), self.length / 2)
        out_y = left - min(max(left, -self.width / 2), self.width / 2)
        distance = math.hypot(out_x, out_y)
        # Inside there is no direction away: to the side is the shortest way out.
        if distance == 0.0:
            out_x, out_y = 0.0, math.copysign(1.0, left)
        size = math.hypot(out_x, out_y)
        out_x, out_y = out_x / size, out_y / size
        c, s = math.cos(self.pose.yaw), math.sin(self.pose.yaw)
        return distance, c * out_x - s * out_y, s * out_x + c * out_y


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
    def from_greenhouse(
        cls, greenhouse: Greenhouse, rng: np.random.Generator | None = None
    ) -> "Scenery":
        """Arrays of a greenhouse; ``rng`` lets its plants lean."""
        screens = greenhouse.rows + tuple(thing.area for thing in greenhouse.obstacles)
        plan = Plan.from_greenhouse(greenhouse)
        return cls(
            plan.bounds,
            plan.rectangles,
            plan.posts,
            np.empty((0, 3)) if rng is None else _leaves(greenhouse.rows, rng),
            screens,
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
    at_low, at_high = low / steep, high / steep
    return np.minimum(at_low, at_high), np.maximum(at_low, at_high)


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


@dataclass(frozen=True, slots=True)
class LaserModel:
    """Data sheet of the sensor.

    Attributes:
        beams: Rays in a full turn.
        range_min: (m); ``range_max`` (m).
        noise: Standard deviation of a range (m); a third of the VLP-16's ±3 cm.
    """

    beams: int = 720
    range_min: float = 0.1
    range_max: float = 30.0
    noise: float = 0.01

    @property
    def angle_increment(self) -> float:
        """Between neighbouring rays (rad); the first points backwards, at -π."""
        return math.tau / self.beams


def sweep(
    sensor: Pose2D,
    model: LaserModel,
    scenery: Scenery,
    people: Sequence[Disc],
    others: Sequence[Body],
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """One turn of the laser.

    Args:
        sensor: Its pose in ``map``.
        model: Its data sheet.
        scenery: Static objects.
        people: People.
        others: The other robots.
        rng: Random source of the noise.

    Returns:
        Shape (beams,), float32 (m); ``inf`` where nothing is within ``range_max``.
    """
    angles = sensor.yaw - math.pi + model.angle_increment * np.arange(model.beams)
    directions = np.stack((np.cos(angles), np.sin(angles)))
    wall = scenery.bounds
    sides = np.array((wall.xmin, wall.ymin, wall.xmax, wall.ymax), float)
    ranges = box_span(directions, sensor, sides)[1]
    crop = box_span(directions, sensor, scenery.rectangles)
    for enter, leave in (crop, *(body.span(directions, sensor) for body in others)):
        hit = np.where((enter <= leave) & (enter >= 0.0), enter, np.inf)
        ranges = np.minimum(ranges, hit.reshape(-1, model.beams).min(0, initial=np.inf))
    discs = [(disc.x, disc.y, disc.radius) for disc in people]
    round_things = np.concatenate(
        (scenery.posts, scenery.leaves, np.reshape(discs, (-1, 3)))
    )
    _discs(sensor, model, round_things, ranges)
    ranges += rng.normal(0.0, model.noise, model.beams)
    ranges[(ranges > model.range_max) | (ranges < model.range_min)] = np.inf
    # Lasers count millimetres.
    return ranges.round(3).astype(np.float32)


def _discs(sensor: Pose2D, model: LaserModel, discs: Floats, ranges: Floats) -> None:
    """Shorten ``ranges`` by discs, shape (n, 3)."""
    # Only rays that can hit are computed: most discs take a few of 720.
    dx, dy = discs[:, 0] - sensor.x, discs[:, 1] - sensor.y
    distance = np.hypot(dx, dy)
    matters = (distance > discs[:, 2]) & (distance < model.range_max + discs[:, 2])
    dx, dy, distance = dx[matters], dy[matters], distance[matters]
    radius = discs[matters, 2]
    middle = np.arctan2(dy, dx) - sensor.yaw + math.pi
    half = np.arcsin(radius / distance)
    first = np.ceil((middle - half) / model.angle_increment).astype(int)
    last = np.floor((middle + half) / model.angle_increment).astype(int)
    counts = np.maximum(last - first + 1, 0)
    which = np.repeat(np.arange(counts.size), counts)
    if not which.size:
        return
    starts = np.repeat(np.cumsum(counts) - counts, counts)
    beams = first[which] + np.arange(which.size) - starts
    off = beams * model.angle_increment - middle[which]
    along = distance[which] * np.cos(off)
    across = distance[which] * np.sin(off)
    depth = np.sqrt(np.maximum(radius[which] ** 2 - across**2, 0.0))
    np.minimum.at(ranges, beams % model.beams, along - depth)
