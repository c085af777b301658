"""A planar laser: 720 rays against everything in the greenhouse, at once.

Ray casting by the slab method for rectangles and by the quadratic for discs, all rays
of a sweep in a few NumPy calls (``benchmarks/lidar_cost.py`` says what it costs).
Left out: intensity, motion during the sweep, leaves that move.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iveg.domain.geometry import Pose2D
from iveg.lab.emulator.greenhouse import Body, Disc, Floats, Scenery, box_span, sides_of


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
    ranges = box_span(directions, sensor, sides_of(scenery.bounds))[1]
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
    """Shorten ``ranges`` by discs, shape (n, 3), for rays that can hit only."""
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
